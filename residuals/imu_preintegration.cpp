#include <algorithm>
#include <cmath>

#include <tandem/lie/coefficients.hpp>
#include <tandem/lie/error.hpp>
#include <tandem/residuals/imu_preintegration.hpp>

namespace tandem {

namespace {

/// Rates of change of the specific force [m/s³] and of the angular rate [rad/s²] that interpolation may miss.
constexpr double kMissedJerk = 5, kMissedAngularAcceleration = 1;

/// Returns the noise of samples that are interpolated across a gap. A rate of change c that interpolation misses causes
/// an error of c T²/2 over a gap of T seconds. White noise with a root density of c T^1.5 / 2 has the same effect.
ImuNoise interpolation_noise(ImuNoise noise, double gap) {
  const double half = 0.5 * gap * std::sqrt(gap);
  noise.accelerometer = std::max(noise.accelerometer, kMissedJerk * half);
  noise.gyroscope = std::max(noise.gyroscope, kMissedAngularAcceleration * half);
  return noise;
}

/// Returns (dE/dθ)/θ, with E of AngleCoefficients.
double E_slope(double theta2, const AngleCoefficients<double>& k) {
  if (theta2 >= AngleCoefficients<double>::kSeriesBelow) return (k.C - 4.0 * k.E) / theta2;
  const double x = theta2;
  return -1. / 360 + x * (1. / 10080 + x * (-1. / 604800 + x * (1. / 59875200 + x * (-1. / 8717829120.))));
}

/// The vector a v + b φ × v + c φ × (φ × v) and its derivatives with respect to φ and v. The coefficients have the
/// derivatives ∂b/∂φ = b_slope φᵀ and ∂c/∂φ = c_slope φᵀ.
struct RotatedIntegral {
  Vector<3> value;
  Matrix<3, 3> by_phi, by_v;

  RotatedIntegral(const Vector<3>& v, double a)
      : value(a * v), by_phi(Matrix<3, 3>::Zero()), by_v(a * Matrix<3, 3>::Identity()) {}
  RotatedIntegral(const Vector<3>& phi, const Vector<3>& v, double a, double b, double c, double b_slope,
                  double c_slope) {
    const Vector<3> once = phi.cross(v), twice = phi.cross(once);
    value = a * v + b * once + c * twice;
    // φ × (φ × v) = (φ·v) φ − φ² v
    by_phi = (b_slope * once + c_slope * twice - (2.0 * c) * v) * phi.transpose() + c * phi * v.transpose();
    by_phi.diagonal().array() += c * phi.dot(v);
    by_phi -= skew(b * v);
    by_v = SO3::polynomial(phi, b, c);
    by_v.diagonal().array() += a - 1.0;
  }
};

/// Propagates errors M of [position; velocity; rotation] over dt. In this interval the specific force changes the
/// velocity by `gained` and the position by `moved` (from rest); a rotation error rotates both.
template <int Columns>
void propagate_errors(const Vector<3>& moved, const Vector<3>& gained, double dt, Matrix<9, Columns>& M) {
  for (int k = 0; k < Columns; ++k) {
    const Vector<3> turn = M.template block<3, 1>(6, k);
    M.template block<3, 1>(0, k) += dt * M.template block<3, 1>(3, k) + turn.cross(moved);
    M.template block<3, 1>(3, k) += turn.cross(gained);
  }
}

}  // namespace

ImuPreintegrator::ImuPreintegrator(const SE3& mount, const ImuNoise& noise, const Vector<6>& bias, ImuHold hold)
    : R_bs_(mount.rotation().matrix()), lever_(mount.translation()), noise_(noise), hold_(hold) {
  delta_.bias = bias;
}

void ImuPreintegrator::integrate(const Vector<3>& specific_force, const Vector<3>& angular_rate, double dt,
                                 const Vector<3>& angular_acceleration) {
  if (!(dt >= 0.0) || !std::isfinite(dt)) throw BadInputError("IMU preintegration: dt must be finite and not negative");
  if (dt == 0.0) return;
  const Vector<3> omega = R_bs_ * (angular_rate - delta_.bias.tail<3>()), at_sensor = omega.cross(lever_);
  const Vector<3> f = R_bs_ * (specific_force - delta_.bias.head<3>()) - (R_bs_ * angular_acceleration).cross(lever_) -
                      omega.cross(at_sensor);

  const Vector<3> phi = dt * omega;
  const double theta2 = phi.squaredNorm();
  const AngleCoefficients<double> k(theta2);
  // ∫ Exp(ω s) f ds divided by dt, and its second integral divided by dt².
  const bool turning = hold_ == ImuHold::turning;
  const double B_slope = 2.0 * k.E - k.C, C_slope = -2.0 * k.F;  // (dB/dθ)/θ and (dC/dθ)/θ
  const RotatedIntegral gain =
      turning ? RotatedIntegral(phi, f, 1.0, k.B, k.C, B_slope, C_slope) : RotatedIntegral(f, 1.0);
  const RotatedIntegral move =
      turning ? RotatedIntegral(phi, f, 0.5, k.C, k.E, C_slope, E_slope(theta2, k)) : RotatedIntegral(f, 0.5);
  const Matrix<3, 3> R = delta_.R.matrix();
  const Vector<3> gained = dt * (R * gain.value), moved = dt * dt * (R * move.value);

  // Effect of a constant sensor error in this interval on the state at its end.
  const Matrix<3, 3> by_gain = dt * R * gain.by_v, by_move = dt * dt * R * move.by_v;
  ByBias G;
  G.block<3, 3>(0, 0).noalias() = by_move * R_bs_;
  G.block<3, 3>(3, 0).noalias() = by_gain * R_bs_;
  G.block<3, 3>(6, 0).setZero();
  G.block<3, 3>(0, 3).noalias() = dt * dt * dt * R * move.by_phi * R_bs_;
  G.block<3, 3>(3, 3).noalias() = dt * dt * R * gain.by_phi * R_bs_;
  G.block<3, 3>(6, 3).noalias() = dt * R * (turning ? gain.by_v : SO3::polynomial(phi, k.B, k.C)) * R_bs_;

  Matrix<3, 3> centripetal = skew(at_sensor) + lever_ * omega.transpose();  // ∂/∂ω: [ω × l]× + [ω]× [l]×
  centripetal.diagonal().array() -= omega.dot(lever_);
  const Matrix<3, 3> at_mount = R_bs_.transpose() * centripetal * R_bs_;
  propagate_errors(moved, gained, dt, by_sensor_error_);
  by_sensor_error_ += G;
  by_sensor_error_.block<3, 3>(0, 3).noalias() += G.block<3, 3>(0, 0) * at_mount;
  by_sensor_error_.block<3, 3>(3, 3).noalias() += G.block<3, 3>(3, 0) * at_mount;

  add_noise(moved, gained, G, dt);

  delta_.p += dt * delta_.v + moved;
  delta_.v += gained;
  delta_.R = delta_.R * SO3::Exp(phi);
  delta_.dt += dt;
  delta_.p_by_bias = -by_sensor_error_.topRows<3>();
  delta_.v_by_bias = -by_sensor_error_.middleRows<3>(3);
  delta_.R_by_bias.noalias() = -delta_.R.inverse().matrix() * by_sensor_error_.bottomRightCorner<3, 3>();
}

void ImuPreintegrator::add_noise(const Vector<3>& moved, const Vector<3>& gained, const ByBias& G, double dt) {
  // White noise has the variance σ²/dt in this interval. The random walk w of a bias has the variance σ² t at the start
  // of the interval. Its mean over the interval is w + u and its value at the end w + u', with E[u u] = σ² dt/3 and E[u
  // u'] = σ² dt/2.
  const double t = delta_.dt, mean = t + dt / 3.0, end = t + dt / 2.0;
  const auto squared = [](double sigma) { return sigma * sigma; };
  const double walk_a = squared(noise_.accelerometer_bias_walk), walk_g = squared(noise_.gyroscope_bias_walk);
  const double half_a = 0.5 * (walk_a * mean + squared(noise_.accelerometer) / dt);
  const double half_g = 0.5 * (walk_g * mean + squared(noise_.gyroscope) / dt);
  propagate_errors(moved, gained, dt, minus_bias_covariance_);
  ByBias half = minus_bias_covariance_;
  half.leftCols<3>() += half_a * G.leftCols<3>();
  half.rightCols<3>() += half_g * G.rightCols<3>();
  minus_bias_covariance_.leftCols<3>() += walk_a * end * G.leftCols<3>();
  minus_bias_covariance_.rightCols<3>() += walk_g * end * G.rightCols<3>();
  propagate_errors(moved, gained, dt, covariance_);
  covariance_.transposeInPlace();
  propagate_errors(moved, gained, dt, covariance_);
  Matrix<9, 9> added;
  added.leftCols<6>().noalias() = half * G.topRows<6>().transpose();
  added.rightCols<3>().noalias() = half.rightCols<3>() * G.block<3, 3>(6, 3).transpose();
  covariance_ += added + added.transpose();
  // Within the interval, white noise gives a position variance of σ² dt³/3, but noise held constant only σ² dt³/4.
  covariance_.diagonal().head<3>().array() +=
      (squared(noise_.integration) + squared(noise_.accelerometer) * dt * dt / 12.0) * dt;
}

void ImuPreintegrator::integrate(const ImuSample& from, const ImuSample& to) {
  const double dt = to.t - from.t;
  if (!(dt > 0.0)) throw BadInputError("IMU preintegration: the times of the samples must increase");
  const ImuNoise given = noise_;
  if (to.gap > 0) noise_ = interpolation_noise(given, to.gap);
  integrate(0.5 * (from.specific_force + to.specific_force), 0.5 * (from.angular_rate + to.angular_rate), dt,
            (to.angular_rate - from.angular_rate) / dt);
  noise_ = given;
}

Matrix<15, 15> ImuPreintegrator::covariance() const {
  const Matrix<3, 3> to_end = delta_.R.inverse().matrix();
  Matrix<9, 9> turned;
  Matrix<15, 15> out = Matrix<15, 15>::Zero();
  for (int i = 0; i < 9; i += 3) {
    for (int j = 0; j < 9; j += 3)
      turned.block<3, 3>(i, j) = to_end * covariance_.block<3, 3>(i, j) * to_end.transpose();
    out.block<3, 6>(i, 9).noalias() = -to_end * minus_bias_covariance_.middleRows<3>(i);
    out.block<6, 3>(9, i) = out.block<3, 6>(i, 9).transpose();
  }
  out.topLeftCorner<9, 9>() = 0.5 * (turned + turned.transpose());
  const double accelerometer = noise_.accelerometer_bias_walk, gyroscope = noise_.gyroscope_bias_walk;
  out.diagonal().segment<3>(9).setConstant(accelerometer * accelerometer * delta_.dt);
  out.diagonal().tail<3>().setConstant(gyroscope * gyroscope * delta_.dt);
  return out;
}

}  // namespace tandem
