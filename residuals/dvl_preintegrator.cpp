#include <algorithm>
#include <cmath>

#include <tandem/lie/error.hpp>
#include <tandem/residuals/dvl_preintegrator.hpp>

namespace tandem {

void DvlPreintegrator::measure(const DvlReading& reading) {
  by_readings_ += of_reading();
  by_reading_.setZero();
  since_ = 0;
  reading_ = reading;
}

void DvlPreintegrator::advance(const Vector<3>& angular_rate, double dt) {
  if (!(dt >= 0.0) || !std::isfinite(dt)) throw BadInputError("DVL preintegration: dt must be finite and not negative");
  if (dt == 0.0) return;
  const Vector<3> turn = dt * angular_rate;
  const Matrix<3, 3> R = R_.matrix(), mean = dt * (R * SO3::Jl(turn));
  const Vector<3> step = mean * reading_.velocity;
  add_gyroscope_noise(R, mean, step, dt);
  by_reading_ += mean;
  displacement_ += step;
  R_ = R_ * SO3::Exp(turn);
  dt_ += dt;
  since_ += dt;
}

Matrix<3, 3> DvlPreintegrator::covariance() const {
  return by_readings_ + of_reading() + by_gyroscope_.topLeftCorner<3, 3>();
}

Matrix<3, 3> DvlPreintegrator::of_reading() const {
  if (since_ == 0) return Matrix<3, 3>::Zero();
  const Matrix<3, 3> A = by_reading_ * reading_.sigma.asDiagonal();
  return std::max(1.0, reading_.hold_time / since_) * (A * A.transpose());
}

void DvlPreintegrator::add_gyroscope_noise(const Matrix<3, 3>& R, const Matrix<3, 3>& mean, const Vector<3>& step,
                                           double dt) {
  if (gyroscope_ == 0) return;
  by_gyroscope_.topRows<3>() -= skew(step) * by_gyroscope_.bottomRows<3>().eval();
  by_gyroscope_.leftCols<3>() += by_gyroscope_.rightCols<3>().eval() * skew(step);
  Matrix<6, 3> by_rate;
  by_rate << -0.5 * dt * dt * R * skew(reading_.velocity), mean;
  by_gyroscope_ += gyroscope_ * gyroscope_ / dt * (by_rate * by_rate.transpose());
}

}  // namespace tandem
