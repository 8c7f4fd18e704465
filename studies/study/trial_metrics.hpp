#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/studies/estimation/estimate_metrics.hpp>

namespace tandem {

/// A number that a trial gives.
struct TrialMetric {
  std::string name;  ///< a column's: "usbl_position_m"
  std::string doc;
  bool timing = false;  ///< depends on the machine: in no table that is the same on any
  bool share = false;   ///< 0 or 1: its mean is a share of the trials
};

/// All of them, in the order of the columns.
const std::vector<TrialMetric>& trial_metrics();
/// The place of one. Throws Error where there is none.
std::size_t metric_index(std::string_view name);

/// How far ahead predictions are held against the truth [s], and the metric of their error.
inline constexpr std::array kAhead = {5.0, 10.0};
std::string ahead_metric(double seconds);

/// What became of one trial of a study.
struct TrialResult {
  std::size_t trial = 0;
  std::string status;                          ///< name(Status), or "refused"
  std::string message;                         ///< why it did not converge, a sentence; else empty
  std::vector<std::optional<double>> metrics;  ///< one each of trial_metrics()

  TrialResult() : metrics(trial_metrics().size()) {}
  bool converged() const { return status == "converged"; }
  void set(std::string_view metric, std::optional<double> value);
  /// Nothing, where nothing was added.
  void set_mean(std::string_view metric, const Moments& of);
  std::optional<double> get(std::string_view metric) const { return metrics[metric_index(metric)]; }
};

/// Errors by keyframe type, of the estimate and of raw measurements, into a result.
void add_errors(const std::vector<KeyframeError>& errors, TrialResult& result);
/// Errors in gaps, from first to last of each, and in the `after` seconds that follow each.
void add_gap_errors(const std::vector<KeyframeError>& errors, const std::vector<std::pair<double, double>>& gaps,
                    double after, TrialResult& result);
/// How long it takes until the error along an axis of the chaser has forgotten itself: where the autocorrelation of the
/// position error, at one sample a second, falls below 1/e [s].
std::optional<double> correlation_time(const std::vector<KeyframeError>& errors);

}  // namespace tandem
