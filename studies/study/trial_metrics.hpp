#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/studies/estimation/estimate_metrics.hpp>

namespace tandem {

/// A number that a trial computes.
struct TrialMetric {
  std::string name;  ///< CSV column, as in "at_position_error_m"
  std::string doc;
  bool timing = false;  ///< whether it depends on the machine; reported separately
  bool share = false;   ///< whether it is 0 or 1, so that its mean is a share of the trials
};

/// Returns all metrics in the order of the columns.
const std::vector<TrialMetric>& trial_metrics();
/// Returns the index of a metric. Throws Error if there is none of this name.
std::size_t metric_index(std::string_view name);

/// Prediction horizons that are compared with the truth [s].
inline constexpr std::array kAhead = {5.0, 10.0};
/// Returns the metric of the prediction error at a horizon.
std::string ahead_metric(double seconds);

/// Result of one trial of a study.
struct TrialResult {
  std::size_t trial = 0;
  std::string status;                          ///< name(Status), or "refused" if nothing was solved
  std::string message;                         ///< reason if the trial did not converge; else empty
  std::vector<std::optional<double>> metrics;  ///< one entry per entry of trial_metrics()

  TrialResult() : metrics(trial_metrics().size()) {}
  bool converged() const { return status == "converged"; }
  /// Sets a metric; a value that is not finite clears it.
  void set(std::string_view metric, std::optional<double> value);
  /// Sets a metric to a mean; has no effect if no value was added.
  void set_mean(std::string_view metric, const Moments& of);
  std::optional<double> get(std::string_view metric) const { return metrics[metric_index(metric)]; }
};

/// Adds mean errors by keyframe type, of the estimate and of raw measurements, to a trial result.
void add_errors(const std::vector<KeyframeError>& errors, TrialResult& result);
/// Adds mean errors within the gaps and in the `after` seconds that follow each gap. `gaps`: start and end [s].
void add_gap_errors(const std::vector<KeyframeError>& errors, const std::vector<std::pair<double, double>>& gaps,
                    double after, TrialResult& result);
/// Returns the correlation time of the relative position error: the lag at which its autocorrelation falls below 1/e
/// [s]. Uses one sample per second; returns nullopt for fewer than 20 samples or a longer correlation.
std::optional<double> correlation_time(const std::vector<KeyframeError>& errors);

}  // namespace tandem
