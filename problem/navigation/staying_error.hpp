#pragma once

#include <cmath>
#include <string>

#include <Eigen/Core>

namespace tandem {

/// Errors that a sensor has beside its noise, states of the problem. A bias is tied to the one before as a first-order
/// Gauss–Markov process, new wherever a measurement finds it changed, or one for the whole recording. Scale, misalignment
/// and delay are constants of the recording; what is said of them are standard deviations, 0 where there is none.
struct StayingError {
  Eigen::VectorXd sigma{};  ///< of the bias: one a row of the sensor's residual, in its units; empty: no bias
  double time = HUGE_VAL;   ///< s, after which a third of the bias is left; infinite: it is constant
  double scale = 0;         ///< lengths and velocities are read 1 + s times as large
  double misalignment = 0;  ///< rad, of the sensor about each of its axes
  double delay = 0;         ///< s, of the time by which measurements are older than the sensor's `delay` says

  bool has_bias() const { return sigma.size() > 0; }
  bool has_constant_bias() const { return has_bias() && std::isinf(time); }
  bool has_constants() const { return scale > 0 || misalignment > 0 || delay > 0; }
};

/// How a sensor's errors are called in noise files and messages.
inline std::string error_name(const std::string& sensor) { return sensor + ".error"; }

/// Empty, or why a sensor of this kind ("a range") cannot have these, by what its measurements tell: a length, how it is
/// turned.
std::string why_not(const StayingError& error, const std::string& kind, bool tells_length, bool tells_turn);

}  // namespace tandem
