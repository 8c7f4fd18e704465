#include <cmath>

#include <tandem/lie/operations.hpp>
#include <tandem/solvers/online/plausible.hpp>

namespace tandem::detail {
namespace {

constexpr double kFarthestPose = 1e8, kFarthestTarget = 1e7;    // m
constexpr double kMostForce = 1e5, kMostRate = 1e4;             // m/s², rad/s
constexpr double kFastest = 200, kFastestTurn = 50;             // m/s, rad/s
constexpr double kResolution = 0.05, kResolutionOfTurn = 0.05;  // m, rad

template <class Derived>
bool within(const Eigen::MatrixBase<Derived>& v, double most) {
  return v.allFinite() && v.cwiseAbs().maxCoeff() <= most;
}

}  // namespace

bool is_plausible(const SE3& pose) {
  return within(pose.translation(), kFarthestPose) && pose.rotation().quaternion().coeffs().allFinite();
}

bool is_plausible(const ImuSample& sample) {
  return within(sample.specific_force, kMostForce) && within(sample.angular_rate, kMostRate);
}

bool is_plausible(const Measurement& m) {
  const Vector<3> distances(m.range, m.height, 0), angles(m.azimuth, m.elevation, 0);
  return within(m.position, kFarthestTarget) && within(distances, kFarthestTarget) && within(angles, kMostRate) &&
         m.rotation.quaternion().coeffs().allFinite();
}

bool is_plausible(EgoSensorType type, const EgoMeasurement& m) {
  return m.value.allFinite() && m.rotation.quaternion().coeffs().allFinite() && m.value.norm() <= type->most;
}

bool follows(const Stamped<SE3>& before, const Stamped<SE3>& after) {
  const double dt = after.t - before.t;
  const Vector<6> step = minus(after.value, before.value);
  return step.head<3>().norm() <= kResolution + kFastest * dt &&
         step.tail<3>().norm() <= kResolutionOfTurn + kFastestTurn * dt;
}

EgoSpread spread_without(EgoSensorType type) {
  EgoSpread spread;
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
