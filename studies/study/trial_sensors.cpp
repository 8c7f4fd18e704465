#include <algorithm>

#include <tandem/studies/simulation/dive_target.hpp>
#include <tandem/studies/study/trial_sensors.hpp>

namespace tandem {

std::vector<TrialSensor> trial_sensors(const TrialSettings& settings, Simulated simulated) {
  std::vector<TrialSensor> sensors;
  const auto add = [&](const TargetSensor& sensor, bool planar) {
    sensors.push_back({sensor.name, rows(sensor.type, planar)});
  };
  if (simulated == Simulated::docking) {
    for (const TargetSensor& sensor : docking_sensors(settings.docking)) add(sensor, settings.docking.planar);
    return sensors;
  }
  if (settings.dive.target) add(dive_target_sensor(settings.dive), false);
  for (const EgoSensorTraits& type : ego_sensor_types()) sensors.push_back({std::string(type.name), rows(type)});
  return sensors;
}

std::vector<std::string> all_trial_sensors() {
  TrialSettings settings;
  settings.dive.target = true;
  std::vector<std::string> names;
  for (const Simulated simulated : {Simulated::docking, Simulated::dive})
    for (const TrialSensor& sensor : trial_sensors(settings, simulated))
      if (std::find(names.begin(), names.end(), sensor.name) == names.end()) names.push_back(sensor.name);
  return names;
}

std::string nis_metric(const std::string& sensor) { return "nis_" + sensor; }

}  // namespace tandem
