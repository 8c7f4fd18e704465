#include <cmath>

#include <Eigen/LU>

#include <tandem/studies/study/constant_velocity_filter.hpp>

namespace tandem {

ConstantVelocityFilter::ConstantVelocityFilter(double acceleration, double velocity_time)
    : velocity_time_(velocity_time), variance_(acceleration * acceleration, acceleration * acceleration, 0.03 * 0.03) {}

void ConstantVelocityFilter::predict(double t) {
  const double dt = t - t_;
  t_ = t;
  Matrix<6, 6> F = Matrix<6, 6>::Identity();
  F.topRightCorner<3, 3>().diagonal().setConstant(travel(dt));
  F.bottomRightCorner<3, 3>().diagonal().setConstant(std::exp(-dt / velocity_time_));
  const Matrix<3, 3> Q = variance_.asDiagonal();
  x_ = (F * x_).eval();
  P_ = (F * P_ * F.transpose()).eval();
  P_.topLeftCorner<3, 3>() += dt * dt * dt / 3 * Q;
  P_.topRightCorner<3, 3>() += dt * dt / 2 * Q;
  P_.bottomLeftCorner<3, 3>() += dt * dt / 2 * Q;
  P_.bottomRightCorner<3, 3>() += dt * Q;
}

void ConstantVelocityFilter::update(double t, const Vector<3>& position, const Matrix<3, 3>& covariance) {
  if (!started_) {
    x_ << position, Vector<3>::Zero();
    P_ = Vector<6>(9, 9, 9, 1, 1, 0.01).asDiagonal();
    t_ = t;
    started_ = true;
    return;
  }
  predict(t);
  const Matrix<6, 3> K = P_.leftCols<3>() * Matrix<3, 3>(P_.topLeftCorner<3, 3>() + covariance).inverse();
  x_ += K * (position - x_.head<3>());
  P_ -= (K * P_.topRows<3>()).eval();
}

double ConstantVelocityFilter::travel(double seconds) const {
  return std::isinf(velocity_time_) ? seconds : -velocity_time_ * std::expm1(-seconds / velocity_time_);
}

}  // namespace tandem
