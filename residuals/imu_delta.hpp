#pragma once

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>

namespace tandem {

/// What an inertial sensor says of the motion between two instants, free of the state at either (Lupton & Sukkarieh
/// 2012; Forster et al. 2017, eqs. 33-38): of the body, the frame that poses are of, whatever the sensor's own mount.
///
///   R_j = R_i R      v_j = v_i + g dt + R_i v      p_j = p_i + v_i dt + g dt²/2 + R_i p
///
/// (see `predict` for the Earth's rotation). Biases b = [accelerometer; gyroscope] are along the sensor's own axes
/// [m/s², rad/s]; the deltas are at `bias`, and change to first order with b away from it.
struct ImuDelta {
  double dt = 0;  ///< s
  SO3 R{};
  Vector<3> v = Vector<3>::Zero();  ///< m/s
  Vector<3> p = Vector<3>::Zero();  ///< m
  Vector<6> bias = Vector<6>::Zero();
  Matrix<3, 3> R_by_bias = Matrix<3, 3>::Zero();  ///< of the gyroscope: R(b) = R Exp(R_by_bias δ)
  Matrix<3, 6> v_by_bias = Matrix<3, 6>::Zero();
  Matrix<3, 6> p_by_bias = Matrix<3, 6>::Zero();
};

}  // namespace tandem
