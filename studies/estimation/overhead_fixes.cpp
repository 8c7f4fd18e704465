#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <tandem/problem/tracking/target_sensor.hpp>
#include <tandem/studies/estimation/overhead_fixes.hpp>

namespace tandem {

std::string overhead_fix(const TrackingData& data, const TrackingProblem& tracking) {
  constexpr double kSigmas = 3;
  double least = HUGE_VAL;  // angle from the axis [rad]
  const TargetSensor* closest = nullptr;
  double t = 0;
  for (const PlacedMeasurement& placed : tracking.measurements) {
    const TargetSensor& sensor = data.sensors[placed.sensor];
    if (!placed.block || !sensor.type->has(measured::angles) || sensor.sigma.size() < 3) continue;
    const Measurement& m = sensor.measurements[placed.index];
    const TargetState target = tracking.target_state(placed.keyframe);
    const SE3 pose(target.rotation.value_or(SO3()), target.position);
    const Vector<3> p =
        (tracking.chaser_pose(placed.keyframe) * sensor.mount).inverse().act(pose.act(sensor.marker.translation()));
    const double estimated = std::atan2(std::hypot(p.x(), p.y()), std::abs(p.z()));
    const double angle = std::min(estimated, std::numbers::pi / 2 - std::abs(m.elevation));
    if (angle > kSigmas * std::max(sensor.sigma[1], sensor.sigma[2]) || angle >= least) continue;
    least = angle;
    closest = &sensor;
    t = m.t;
  }
  if (!closest) return {};
  return fmt::format("{} at {:.3f} s sees the target {:.2g} deg from the sensor's z axis", closest->name, t,
                     std::max(least, 0.0) * 180 / std::numbers::pi);
}

}  // namespace tandem
