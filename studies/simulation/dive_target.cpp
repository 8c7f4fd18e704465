#include <cmath>
#include <numbers>

#include <tandem/studies/simulation/dive_target.hpp>
#include <tandem/studies/simulation/normal_noise.hpp>

namespace tandem {
namespace {

constexpr double kVesselSpeed = 1.3, kTurnRate = 0.01;  // m/s, rad/s
constexpr double kVesselSway = 0.02;                    // rad: amplitude of roll and pitch in waves
constexpr std::uint32_t kFixStream = 20;                // noise stream, distinct from those of the chaser's sensors

/// Returns the pose of the vessel: a circle near the start of the survey, with roll and pitch in waves.
SE3 vessel_at(double t) {
  const double radius = kVesselSpeed / kTurnRate, yaw = kTurnRate * t;
  const auto wave = [&](double period) { return kVesselSway * std::sin(2 * std::numbers::pi * t / period); };
  return SE3(SO3::Exp({0, 0, yaw}) * SO3::Exp({wave(4.1), wave(5.3), 0}),
             Vector<3>(40 + radius * std::sin(yaw), radius * (1 - std::cos(yaw)) - 30, 0));
}

}  // namespace

TargetSensor dive_target_sensor(const DiveOptions& options) {
  return {.name = "usbl", .type = SensorType::position, .sigma = Vector<3>::Constant(options.usbl_sigma)};
}

void add_dive_target(const DiveOptions& options, SimulatedDive& dive) {
  TargetSensor usbl = dive_target_sensor(options);
  NormalNoise noise(options.seed, kFixStream);
  double next = options.usbl_period;
  for (const auto& [t, chaser] : dive.truth) {
    const SE3 vessel = vessel_at(t);
    dive.truth_target.push_back({t, vessel});
    if (t < next - kSameInstant) continue;
    next += options.usbl_period;
    const Vector<3> error = noise.vector(options.usbl_sigma);
    const Vector<3> seen = chaser.rotation().inverse().act(Vector<3>(vessel.translation() - chaser.translation()));
    usbl.measurements.push_back({.t = t, .position = options.noise ? Vector<3>(seen + error) : seen});
  }
  dive.tracking.keyframe_interval = options.keyframe_interval;
  dive.tracking.sensors = {std::move(usbl)};
  dive.tracking.noise.constant_twist = (Vector<6>() << 0.05, 0.02, 0.02, 0.01, 0.01, 0.01).finished();
  dive.tracking.noise.constant_velocity.setConstant(0.05);
}

}  // namespace tandem
