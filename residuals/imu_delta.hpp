#pragma once

#include <tuple>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>

namespace tandem {

/// Preintegrated inertial measurements between two instants, independent of the states there (Lupton & Sukkarieh 2012;
/// Forster et al. 2017, eqs. 33-38). They refer to the body frame of the poses, not to the frame of the sensor.
///
///   R_j = R_i R      v_j = v_i + g dt + R_i v      p_j = p_i + v_i dt + g dt²/2 + R_i p
///
/// See `predict` for the Earth's rotation. Biases b = [accelerometer; gyroscope] [m/s², rad/s] are along the sensor
/// axes. The deltas are computed with `bias`; the derivatives correct them to first order for other biases.
struct ImuDelta {
  double dt = 0;  ///< s
  SO3 R{};
  Vector<3> v = Vector<3>::Zero();  ///< m/s
  Vector<3> p = Vector<3>::Zero();  ///< m
  Vector<6> bias = Vector<6>::Zero();
  Matrix<3, 3> R_by_bias = Matrix<3, 3>::Zero();  ///< gyroscope only: R(b) = R Exp(R_by_bias δ)
  Matrix<3, 6> v_by_bias = Matrix<3, 6>::Zero();
  Matrix<3, 6> p_by_bias = Matrix<3, 6>::Zero();

  auto fields() { return std::tie(dt, R, v, p, bias, R_by_bias, v_by_bias, p_by_bias); }
};

}  // namespace tandem
