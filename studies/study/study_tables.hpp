#pragma once

#include <string>
#include <vector>

#include <tandem/studies/study/study.hpp>
#include <tandem/studies/study/trial_metrics.hpp>
#include <tandem/studies/support/statistics.hpp>

namespace tandem {

/// Trials of one combination of values, model and solver: all that differs among them is the seed.
struct StudyGroup {
  std::size_t cell = 0, model = 0, solver = 0;
  std::string cell_text, model_text, solver_text;
  bool planar = false;                        ///< its squared errors have fewer degrees of freedom
  std::size_t trials = 0, converged = 0;      ///< that are there; those of them whose numbers count
  std::vector<const TrialResult*> results{};  ///< the converged ones, by replicate; nullptr where there is none
  /// Of all trials, those that end at the best cost known of their problem, within 1e-6 of it: the least of all
  /// starts of the same data and model.
  std::size_t reached_best = 0;
};

/// The mean of a metric over seeds; a share's interval is Wilson's, others are by Student's t.
struct StudyMean {
  const StudyGroup* group;
  std::string metric;
  Interval mean;
};

/// How many times the error of `base` that of `group` is, over the seeds of which both are there.
struct StudyPair {
  const StudyGroup* group;
  std::string base;  ///< "raw", or the first model of the same cell and solver
  std::string metric;
  Interval ratio;
};

/// Whether errors are as large as their covariances say. Each trial counts as one sample, whatever the number of its
/// keyframes, whose errors go together: the band is a careful one.
struct StudyConsistency {
  const StudyGroup* group;
  std::string metric;
  int degrees;
  Interval mean;        ///< over trials
  double low, high;     ///< the 95 % band of such a mean, were the covariances right
  double sigma_factor;  ///< by which errors are larger than the σ stated
  std::string verdict;  ///< "consistent", "optimistic by a factor 1.3", "pessimistic by a factor 1.2"
};

/// What a study has found out, of the trials that are there. The same for any order in which they were done.
struct StudyTables {
  StudyTables() = default;
  StudyTables(StudyTables&&) = default;  // rows point at groups

  std::vector<StudyGroup> groups;
  std::vector<StudyMean> means;
  std::vector<StudyMean> times;  ///< metrics that depend on the machine
  std::vector<StudyPair> pairs;
  std::vector<StudyConsistency> consistency;
  std::size_t trials = 0, all = 0;  ///< that are there, of so many
  bool disturbed_starts = false;    ///< reached_best says something
};

/// By which trials of a study are better and worse: an error, or how far a rendezvous missed [m].
std::string_view rank_metric(const Study& study);

/// `results` has to live as long.
StudyTables study_tables(const Study& study, const std::vector<TrialResult>& results);

}  // namespace tandem
