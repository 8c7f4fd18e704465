#include <tandem/residuals/direction.hpp>
#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/solvers/online/target_fix.hpp>

namespace tandem::detail {
namespace {

// Factors on the scenario's noise, chosen with ten simulated dockings (bench_online).
constexpr double kDrift = 5.0 / 3, kSurge = 1.0 / 4, kYawRate = 1.0 / 8;
constexpr double kYawTime = 60;  // time constant of a turn [s]

double heading_of(const SO3& R) {
  const Vector<3> forward = R.act(Vector<3>::UnitX());
  return std::atan2(forward.y(), forward.x());
}

/// Returns the covariance of a measured position [m²] in the chaser's body.
Matrix<3, 3> position_covariance(const TargetSensor& sensor, const Measurement& m) {
  Matrix<3, 3> axes = sensor.mount.rotation().matrix();
  Vector<3> sigma;
  if (sensor.type->has(measured::position)) {
    sigma = sensor.sigma.head<3>();
    if (sensor.type->has(measured::rotation)) axes *= m.rotation.matrix();
  } else {  // range along the line of sight, bearings across
    const Direction<3> sight(m.azimuth, m.elevation);
    axes *= (Matrix<3, 3>() << sight.unit(), sight.axes()).finished();
    sigma << sensor.sigma[0], m.range * sensor.sigma[1], m.range * sensor.sigma[2];
  }
  return axes * sigma.cwiseAbs2().asDiagonal() * axes.transpose();
}

}  // namespace

TargetFix target_fix(const TargetSensor& sensor, const Measurement& m, const SE3& chaser,
                     const TrackingOptions& options) {
  const Matrix<3, 3> R = chaser.rotation().matrix();
  TargetFix fix{chaser.act(*sensor.position_in_chaser(m)),
                R * position_covariance(sensor, m) * R.transpose(),
                {},
                0,
                loss_of(sensor, options)};
  if (sensor.type->has(measured::rotation)) {
    fix.heading = heading_of(chaser.rotation() * sensor.pose_in_chaser(m).rotation());
    fix.heading_sigma = sensor.sigma[5];
  }
  return fix;
}

HypothesesNoise hypotheses_noise(const TrackingNoise& noise) {
  return {.drift = kDrift * noise.constant_velocity.head<2>().norm() / std::sqrt(2.0),
          .drift_time = noise.velocity_time.head<2>().minCoeff(),
          .surge = kSurge * noise.constant_twist[0],
          .yaw_rate = kYawRate * noise.constant_twist[5],
          .yaw_time = kYawTime,
          .climb = noise.constant_velocity[2],
          .tilt = noise.odometry.segment<2>(3).norm() / std::sqrt(2.0)};
}

HypothesesLimits hypotheses_limits(const TrackingOptions& options, const TrackingNoise& noise) {
  HypothesesLimits limits;
  if (options.limits == Role::off) return limits;
  if (options.surge) {
    limits.min_surge = options.surge->lower[0];
    limits.max_surge = options.surge->upper[0];
  }
  limits.max_yaw_rate = options.max_yaw_rate.value_or(HUGE_VAL);
  if (options.limits == Role::hard) return limits;
  limits.surge_sigma = noise.surge;
  limits.yaw_rate_sigma = noise.yaw_rate;
  return limits;
}

}  // namespace tandem::detail
