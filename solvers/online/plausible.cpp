#include <cmath>

#include <tandem/lie/operations.hpp>
#include <tandem/solvers/online/plausible.hpp>

namespace tandem::detail {
namespace {

constexpr double kMaxPoseDistance = 1e8, kMaxTargetDistance = 1e7;  // m
constexpr double kMaxForce = 1e5, kMaxRate = 1e4;                   // m/s², rad/s
constexpr double kMaxSpeed = 200, kMaxTurnRate = 50;                // m/s, rad/s
constexpr double kResolution = 0.05, kAngleResolution = 0.05;       // m, rad

template <class Derived>
bool within(const Eigen::MatrixBase<Derived>& v, double most) {
  return v.allFinite() && v.cwiseAbs().maxCoeff() <= most;
}

}  // namespace

bool is_plausible(const SE3& pose) {
  return within(pose.translation(), kMaxPoseDistance) && pose.rotation().quaternion().coeffs().allFinite();
}

bool is_plausible(const ImuSample& sample) {
  return within(sample.specific_force, kMaxForce) && within(sample.angular_rate, kMaxRate);
}

bool is_plausible(const Measurement& m) {
  const Vector<3> distances(m.range, m.height, 0), angles(m.azimuth, m.elevation, 0);
  return within(m.position, kMaxTargetDistance) && within(distances, kMaxTargetDistance) && within(angles, kMaxRate) &&
         m.rotation.quaternion().coeffs().allFinite();
}

bool is_plausible(EgoSensorType type, const EgoMeasurement& m) {
  return m.value.allFinite() && m.rotation.quaternion().coeffs().allFinite() && m.value.norm() <= type->max_magnitude;
}

bool is_plausible_motion(const Stamped<SE3>& before, const Stamped<SE3>& after) {
  const double dt = after.t - before.t;
  const Vector<6> step = minus(after.value, before.value);
  return step.head<3>().norm() <= kResolution + kMaxSpeed * dt &&
         step.tail<3>().norm() <= kAngleResolution + kMaxTurnRate * dt;
}

EgoStateSigmas sigmas_without_sensor(EgoSensorType type) {
  EgoStateSigmas spread;
  switch (type->reading) {
    case EgoReading::body_vector:
      spread.velocity.setConstant(10);
      break;
    case EgoReading::world_vector:
      spread.position.setConstant(1e3);
      break;
    case EgoReading::world_height:
      spread.position.z() = 1e3;
      break;
    case EgoReading::orientation:
      spread.rotation.z() = 3;
      break;
  }
  return spread;
}

}  // namespace tandem::detail
