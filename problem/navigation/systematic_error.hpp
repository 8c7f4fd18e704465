#pragma once

#include <cmath>
#include <string>

#include <Eigen/Core>

namespace tandem {

/// Systematic errors of a sensor, which are estimated as states. All members are prior standard deviations, except the
/// correlation time. The priors have zero mean. A standard deviation of zero disables the error.
///
/// The bias is a first-order Gauss–Markov process (GaussMarkov), or a constant if its correlation time is infinite.
/// Scale factor, misalignment and delay are constants.
struct SystematicError {
  Eigen::VectorXd bias_sigma{};        ///< One entry per residual row, in the residual's units; empty: no bias.
  double correlation_time = HUGE_VAL;  ///< s, of the bias; infinite: constant bias.
  double scale_sigma = 0;              ///< Scale factor error s: the sensor reads (1 + s) times the length or velocity.
  double misalignment_sigma = 0;       ///< rad, about each axis of the sensor.
  double delay_sigma = 0;              ///< s, of the delay in addition to the sensor's `delay`.

  bool has_bias() const { return bias_sigma.size() > 0; }
  bool has_constant_bias() const { return has_bias() && std::isinf(correlation_time); }
  bool has_constants() const { return scale_sigma > 0 || misalignment_sigma > 0 || delay_sigma > 0; }
};

/// Returns the name of a sensor's systematic error in noise files and messages: "SENSOR.error".
inline std::string error_name(const std::string& sensor) { return sensor + ".error"; }

/// Returns why a sensor cannot have these errors, or an empty string. `kind` names the sensor in the text, e.g. "a
/// range". A scale factor requires that the sensor measures a length or a velocity. A misalignment requires that its
/// measurements depend on its orientation.
std::string why_unsupported(const SystematicError& error, const std::string& kind, bool measures_length,
                            bool depends_on_orientation);

}  // namespace tandem
