#pragma once

#include <string>
#include <vector>

#include <tandem/studies/study/study.hpp>
#include <tandem/studies/study/trial_metrics.hpp>
#include <tandem/studies/study/trial_sensors.hpp>
#include <tandem/studies/support/statistics.hpp>

namespace tandem {

/// Trials of one combination of parameter values, model and solver. They differ only in the seed.
struct StudyGroup {
  std::size_t cell = 0, model = 0, solver = 0;
  std::string cell_text, model_text, solver_text;
  bool planar = false;                        ///< In the plane, an NEES has fewer degrees of freedom.
  std::vector<TrialSensor> sensors{};         ///< Sensors of the trials.
  std::size_t trials = 0, converged = 0;      ///< Finished trials, and the converged ones among them.
  std::vector<const TrialResult*> results{};  ///< Converged trials by replicate; nullptr for the others.
  /// Number of trials that reach the best known cost of their problem, within a relative 1e-6. The best known cost is
  /// the minimum over all initial guesses and solvers for the same data and model.
  std::size_t reached_best = 0;
};

/// Mean of a metric over seeds with its 95 % confidence interval: Wilson's for a share, else Student's t.
struct StudyMean {
  const StudyGroup* group;
  std::string metric;
  Interval mean;
};

/// Mean error of `group` divided by the mean error of `base`, over the seeds on which both converged.
struct StudyPair {
  const StudyGroup* group;
  std::string base;  ///< "raw", or the first model of the same cell and solver
  std::string metric;
  Interval ratio;
};

/// Consistency of the errors with their covariances. Each trial counts as one sample because the errors of its
/// keyframes are correlated, so the band is conservative.
struct StudyConsistency {
  const StudyGroup* group;
  std::string metric;
  int degrees;
  Interval mean;        ///< over trials
  double low, high;     ///< 95 % band of the mean of a consistent estimator
  double sigma_factor;  ///< ratio of the actual errors to the stated σ
  std::string verdict;  ///< "consistent", "optimistic by a factor 1.3", "pessimistic by a factor 1.2"
};

/// Statistics of the finished trials of a study. They do not depend on the order of the trials.
struct StudyTables {
  StudyTables() = default;
  StudyTables(StudyTables&&) = default;  // not copyable: rows point to `groups`

  std::vector<StudyGroup> groups;
  std::vector<StudyMean> means;
  std::vector<StudyMean> times;  ///< means of metrics that depend on the machine
  std::vector<StudyPair> pairs;
  std::vector<StudyConsistency> consistency;
  std::size_t trials = 0, all = 0;      ///< finished trials, and trials of the whole study
  bool disturbs_initial_guess = false;  ///< the study disturbs initial guesses, so reached_best is informative
};

/// Returns the metric that ranks the trials of a study: a mean error, or the least miss distance of a rendezvous [m].
std::string_view rank_metric(const Study& study);

/// Computes the tables. `results` must outlive them.
StudyTables study_tables(const Study& study, const std::vector<TrialResult>& results);

}  // namespace tandem
