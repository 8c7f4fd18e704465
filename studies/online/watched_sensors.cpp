#include <tandem/studies/navigation/navigated_scenario.hpp>
#include <tandem/studies/online/watched_sensors.hpp>

namespace tandem {

std::vector<JudgedSensor> watched_sensors(const Scenario& settings) {
  std::vector<JudgedSensor> all;
  if (!moves_by_odometry(settings))
    for (const EgoSensor& sensor : settings.navigation->sensors)
      all.push_back({sensor.name, component_names(sensor, settings.frame.is_ned())});
  for (const TargetSensor& sensor : settings.data.sensors)
    all.push_back({sensor.name, component_names(sensor, settings.data.planar)});
  return all;
}

std::vector<std::string> names_of_watched_sensors(const Scenario& settings) {
  std::vector<std::string> names;
  for (const JudgedSensor& sensor : watched_sensors(settings)) names.push_back(sensor.name);
  return names;
}

}  // namespace tandem
