#include <utility>

#include <tandem/problem/tracking/ego_track.hpp>
#include <tandem/studies/fit/judged_measurements.hpp>

namespace tandem {
namespace {

std::vector<std::string> names(const Components& components) {
  std::vector<std::string> names;
  for (const Component& component : components) names.push_back(component.name);
  return names;
}

}  // namespace

Components point_components(bool planar) { return planar ? Components{{"x"}, {"y"}} : Components{{"x"}, {"y"}, {"z"}}; }

Components rotation_components(bool planar) {
  return planar ? Components{{"yaw", true}} : Components{{"rx", true}, {"ry", true}, {"rz", true}};
}

Components pose_components(bool planar) {
  Components components = point_components(planar);
  for (Component& angle : rotation_components(planar)) components.push_back(std::move(angle));
  return components;
}

Components sensor_components(SensorType type, bool planar) {
  const Component azimuth{"azimuth", true}, elevation{"elevation", true};
  Components components;
  const auto add = [&](unsigned part, const Components& more) {
    if (type->has(part)) components.insert(components.end(), more.begin(), more.end());
  };
  add(measured::position, point_components(planar));
  add(measured::rotation, rotation_components(planar));
  add(measured::range, {{"range"}});
  add(measured::direction, planar ? Components{{"bearing", true}} : Components{azimuth, elevation});
  add(measured::angles, {azimuth, elevation});
  add(measured::height, {{"height"}});
  return components;
}

Components ego_components(const EgoSensor& sensor) {
  if (sensor.type->reading == EgoReading::world_height) return {{"height"}};
  if (sensor.type->reading == EgoReading::orientation) return rotation_components(false);
  return point_components(false);
}

std::vector<std::string> component_names(const EgoSensor& sensor, bool north_east) {
  std::vector<std::string> all = names(ego_components(sensor));
  if (north_east && sensor.type->reading == EgoReading::world_vector) std::swap(all[0], all[1]);
  return all;
}

std::vector<std::string> component_names(const TargetSensor& sensor, bool planar) {
  return names(sensor_components(sensor.type, planar));
}

/// Entries of TrackingNoise that belong to motion, not to constraints.
constexpr std::array<std::string_view, 4> kMotionNoises = {"odometry", "constant_twist", "constant_velocity",
                                                           "acceleration"};

JudgedMeasurements judged_measurements(const Scenario& scenario, const TrackingProblem& built) {
  JudgedMeasurements judged;
  for (const TargetSensor& sensor : scenario.data.sensors)
    judged.sensors.push_back({sensor.name, component_names(sensor, scenario.data.planar)});
  const int rotation = scenario.data.planar ? 2 : 3;  // first orientation row of a pose
  for (const PlacedMeasurement& m : built.measurements) {
    const double t = scenario.data.sensors[m.sensor].measurements[m.index].t;
    if (m.block) judged.blocks.push_back({m.sensor, t, *m.block});
    if (m.orientation) judged.blocks.push_back({m.sensor, t, *m.orientation, rotation});
    if (!m.block && !m.orientation && !m.innovation) judged.sensors[m.sensor].rejected.push_back(t);
  }
  for (const NoiseBlock& noised : built.noise_blocks)
    if (std::find(kMotionNoises.begin(), kMotionNoises.end(), noised.noise) != kMotionNoises.end())
      judged.noises.push_back({noised.noise, noised.block});
  if (scenario.data.ego)
    add_own_sensors(scenario.data.ego->data, built.ego_measurements, scenario.frame.is_ned(), judged);
  return judged;
}

void add_own_sensors(const NavigationData& data, const std::vector<PlacedEgoMeasurement>& placed, bool north_east,
                     JudgedMeasurements& judged) {
  const std::size_t first = judged.sensors.size();
  for (const EgoSensor& sensor : data.sensors)
    judged.sensors.push_back({sensor.name, component_names(sensor, north_east)});
  for (const PlacedEgoMeasurement& m : placed)
    if (m.block) judged.blocks.push_back({first + m.sensor, m.t, *m.block});
}

}  // namespace tandem
