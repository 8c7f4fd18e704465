#pragma once

#include <cmath>

#include <Eigen/Core>

namespace tandem {

/// An error that a sensor keeps for a while: a state tied to the one before as a first-order Gauss–Markov process, new
/// wherever a measurement finds it changed, or one for the whole recording.
struct StayingError {
  Eigen::VectorXd sigma;   ///< one a row of the sensor's residual, in its units
  double time = HUGE_VAL;  ///< s, after which a third of it is left; infinite: it is constant
};

}  // namespace tandem
