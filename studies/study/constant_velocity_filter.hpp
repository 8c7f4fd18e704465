#pragma once

#include <tandem/lie/types.hpp>

namespace tandem {

/// Kalman filter of a target's position and velocity in the world with white acceleration noise and optional velocity
/// decay. It is the baseline for online tracking.
/// Source: Bar-Shalom, Li & Kirubarajan 2001, "Estimation with Applications to Tracking and Navigation", §6.2.2.
class ConstantVelocityFilter {
 public:
  /// `acceleration`: root spectral density along x and y [m s^-3/2]; 0.03 is used along z. `velocity_time`: time
  /// constant of the velocity decay [s]; infinite for constant velocity.
  ConstantVelocityFilter(double acceleration, double velocity_time);

  bool started() const { return started_; }
  /// Predicts to the time t [s], which must not be before the last one. Requires started().
  void predict(double t);
  /// Predicts to t [s] and corrects with a fix: its position [m] and covariance [m²]. The first fix initialises the
  /// filter with a fixed covariance; its own is ignored.
  void update(double t, const Vector<3>& position, const Matrix<3, 3>& covariance);

  /// Returns the predicted position `ahead` seconds after the last time [m].
  Vector<3> position(double ahead = 0) const { return x_.head<3>() + travel(ahead) * x_.tail<3>(); }

 private:
  double travel(double seconds) const;  ///< distance covered in `seconds` from an initial velocity of 1 m/s

  double velocity_time_;
  Vector<3> variance_;  // spectral density of the acceleration [m² s⁻³]
  Vector<6> x_;
  Matrix<6, 6> P_;
  double t_ = 0;
  bool started_ = false;
};

}  // namespace tandem
