#include <numbers>

#include <fmt/format.h>

#include <tandem/problem/tracking/target_sensor.hpp>
#include <tandem/studies/estimation/turned_detections.hpp>

namespace tandem {
namespace {

constexpr double kTurned = 150.0;  // deg
constexpr double kSoon = 5.0;      // s

}  // namespace

std::string turned_detections(const TrackingData& data, const TrackingProblem& tracking) {
  const PlacedMeasurement* before = nullptr;
  SO3 rotation_before;
  for (const PlacedMeasurement& placed : tracking.measurements) {
    const TargetSensor& sensor = data.sensors[placed.sensor];
    if (!placed.block || !sensor.type->has(measured::rotation)) continue;
    const Measurement& m = sensor.measurements[placed.index];
    const SO3 rotation = tracking.chaser_pose(placed.keyframe).rotation() * sensor.pose_in_chaser(m).rotation();
    if (before && before->sensor == placed.sensor) {
      const double t = sensor.measurements[before->index].t;
      const double turn = (rotation_before.inverse() * rotation).Log().norm() * 180 / std::numbers::pi;
      if (turn > kTurned && m.t - t <= kSoon)
        return fmt::format("{} turns by {:.0f} deg between {:.1f} s and {:.1f} s", sensor.name, turn, t, m.t);
    }
    before = &placed;
    rotation_before = rotation;
  }
  return {};
}

}  // namespace tandem
