#pragma once

#include <tandem/lie/types.hpp>

namespace tandem {

/// The textbook filter that online tracking has to beat: a Kalman filter of a target's position and velocity in the world,
/// which white acceleration drives, and whose velocity may be forgotten. Source: Bar-Shalom, Li & Kirubarajan 2001,
/// "Estimation with Applications to Tracking and Navigation", §6.2.2.
class ConstantVelocityFilter {
 public:
  /// `acceleration`: root spectral density along x and y [m s^-3/2]; 0.03 along z. `velocity_time`: in which the velocity is
  /// forgotten [s], or infinite.
  ConstantVelocityFilter(double acceleration, double velocity_time);

  bool started() const { return started_; }
  /// To the time t [s], no earlier than the last one. started() is required.
  void predict(double t);
  /// A fix at t: its position [m], and the covariance of that [m²]. The first one starts the filter, without its noise.
  void update(double t, const Vector<3>& position, const Matrix<3, 3>& covariance);

  /// `ahead` seconds after the last time.
  Vector<3> position(double ahead = 0) const { return x_.head<3>() + way(ahead) * x_.tail<3>(); }

 private:
  double way(double seconds) const;  ///< that a velocity of one goes

  double velocity_time_;
  Vector<3> variance_;  // of the acceleration, m² s⁻³
  Vector<6> x_;
  Matrix<6, 6> P_;
  double t_ = 0;
  bool started_ = false;
};

}  // namespace tandem
