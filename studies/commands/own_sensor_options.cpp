#include <algorithm>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/own_sensor_options.hpp>
#include <tandem/studies/support/option_values.hpp>

namespace tandem {

void add_own_sensors(CommandOptions& option, OwnSensorOptions& own, bool recording, bool everyday) {
  EgoOptions& ego = own.navigation.ego;
  option.group(kOwnSensors);
  if (!everyday) option.advanced();
  option("--alignment", "SECONDS", "Data used to find the initial heading if no sensor measures it [s] (default 30)",
         own.navigation.alignment, recording ? parse_non_negative : parse_positive);
  option.flag("--dvl-scale", "Estimate the scale factor of the DVL", ego.dvl_scale);
  option.advanced();
  option.flag("--preintegrated-dvl",
              "Preintegrate the DVL velocities between keyframes into one residual, for comparison",
              ego.preintegrated_dvl);
  if (!recording) return;
  option.flag("--vibration", "Use the scatter of the IMU samples as its noise if it far exceeds the stated noise",
              own.navigation.vibration);
  option.flag("--no-earth-rotation", "Neglect the rotation of the Earth", own.no_earth_rotation);
}

void apply(const OwnSensorOptions& own, NavigationData& data) {
  const EgoOptions& ego = own.navigation.ego;
  const bool dvl = std::any_of(data.sensors.begin(), data.sensors.end(),
                               [](const EgoSensor& sensor) { return sensor.type == EgoSensorType::dvl; });
  if (ego.dvl_scale && ego.preintegrated_dvl)
    throw Error("--dvl-scale needs each DVL velocity as a residual; remove --preintegrated-dvl");
  if (ego.dvl_scale && !dvl) throw Error("--dvl-scale needs a dvl among the sensors in use");
  if (ego.preintegrated_dvl && !(dvl && data.imu))
    throw Error("--preintegrated-dvl needs a dvl and an imu among the sensors in use");
  if (own.navigation.vibration && !data.imu) throw Error("--vibration needs an imu among the sensors in use");
  if (own.no_earth_rotation) data.earth.rate.setZero();
}

}  // namespace tandem
