#include <numbers>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include <tandem/problem/tracking/target_sensor.hpp>
#include <tandem/studies/estimation/turned_detections.hpp>

namespace tandem {
namespace {

constexpr double kMinTurn = 150.0;    // deg
constexpr double kMaxInterval = 5.0;  // s

}  // namespace

std::string turned_detections(const TrackingData& data, const TrackingProblem& tracking) {
  struct Detection {
    double t;
    SO3 rotation;
  };
  std::vector<std::optional<Detection>> last(data.sensors.size());
  for (const PlacedMeasurement& placed : tracking.measurements) {
    const TargetSensor& sensor = data.sensors[placed.sensor];
    if (!placed.block || !sensor.type->has(measured::rotation)) continue;
    const Measurement& m = sensor.measurements[placed.index];
    const SO3 rotation = tracking.chaser_pose(placed.keyframe).rotation() * sensor.pose_in_chaser(m).rotation();
    std::optional<Detection>& before = last[placed.sensor];
    if (before) {
      const double turn = (before->rotation.inverse() * rotation).Log().norm() * 180 / std::numbers::pi;
      if (turn > kMinTurn && m.t - before->t <= kMaxInterval)
        return fmt::format("{} turns by {:.0f} deg between {:.1f} s and {:.1f} s", sensor.name, turn, before->t, m.t);
    }
    before = Detection{m.t, rotation};
  }
  return {};
}

}  // namespace tandem
