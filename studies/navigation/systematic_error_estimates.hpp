#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/problem/navigation/sensor_constants.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/online/online_estimator.hpp>

namespace tandem {

/// Verdict on an estimated systematic error of a sensor.
enum class SystematicErrorVerdict {
  no_standard_error,        ///< Identifiability is unknown, because the estimate has no standard error.
  identifiable,             ///< The data are more informative than the prior.
  improves_prediction,      ///< Identifiable, and held-out measurements are predicted better with it than without.
  no_improvement,           ///< Identifiable, but held-out measurements are not predicted better.
  not_identifiable,         ///< The data are less informative than the prior.
  inconsistent_with_prior,  ///< More than two prior standard deviations from 0: another model error may cause it.
  inconsistent_but_improves_prediction,  ///< As before, but held-out measurements are predicted better with it.
};
/// Returns the verdict as tables, messages and files have it.
std::string_view text(SystematicErrorVerdict verdict);

/// Estimate of one component of a sensor's systematic error (SensorConstant or, online, its bias). The prior mean is 0.
struct SystematicErrorEstimate {
  std::string name;        ///< "usbl.scale", "camera.misalignment.rx", "dvl.delay", "gps.bias.2" (second component).
  double value = 0;        ///< Scale (the sensor reads 1 + value), misalignment [rad], delay [s], bias [sensor's unit].
  double prior_sigma = 0;  ///< Prior standard deviation.
  double sigma = 0;        ///< Posterior standard deviation; 0 if unknown.
  /// Gain in log-likelihood of held-out measurements by estimating this error, and its standard error.
  struct HeldOut {
    double gain, error;
  };
  std::optional<HeldOut> held_out{};  ///< only after cross-validation

  SystematicErrorVerdict verdict() const;
  /// Returns for example "usbl.scale 0.0213 ± 0.0012".
  std::string text() const;
};

/// Returns the estimates at the problem's current values. `marginals` are those of the problem at these values; without
/// them (null), standard deviations are 0.
std::vector<SystematicErrorEstimate> systematic_error_estimates(const Problem& problem,
                                                                const std::vector<SensorConstant>& constants,
                                                                const Marginals* marginals);

/// Returns the estimates of a solved tracking problem. The standard deviation of a delay comes from
/// profile_evidence_sigma(), at most that of its prior, because the linearised one is too small; it is 0 if the
/// evidence gives none.
std::vector<SystematicErrorEstimate> systematic_error_estimates_by_evidence(
    const Problem& problem, const std::vector<SensorConstant>& constants, const Marginals& marginals, const Stop& stop);

/// Converts the estimates of an online estimator; of a time-correlated bias, the value at its sensor's last
/// measurement.
std::vector<SystematicErrorEstimate> online_systematic_errors(const std::vector<OnlineEstimator::SensorError>& errors);

/// Returns a line per estimate with its verdict, and advice; empty without estimates.
std::string systematic_errors_text(const std::vector<SystematicErrorEstimate>& constants);
/// Returns advice on how to proceed with these verdicts, or an empty string.
std::string systematic_errors_advice(const std::vector<SystematicErrorVerdict>& verdicts);

}  // namespace tandem
