#include <algorithm>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/own_sensor_options.hpp>
#include <tandem/studies/support/option_values.hpp>

namespace tandem {

void add_own_sensors(CommandOptions& option, OwnSensorOptions& own, bool recording) {
  EgoOptions& ego = own.navigation.ego;
  option.group(kOwnSensors);
  option("--alignment", "SECONDS", "Data that decide a heading that none measures (default 30)",
         own.navigation.alignment, recording ? parse_magnitude : parse_positive);
  option.flag("--dvl-scale", "Estimate the DVL's scale factor", ego.dvl_scale);
  option.flag("--preintegrated-dvl", "To compare: DVL velocities summed up between keyframes", ego.preintegrated_dvl);
  if (!recording) return;
  option.flag("--vibration",
              "Where the IMU's samples scatter far more than its noise would, the noise is what they show",
              own.navigation.vibration);
  option.flag("--no-earth-rotation", "Take the world as inertial", own.no_earth_rotation);
}

void apply(const OwnSensorOptions& own, NavigationData& data) {
  const EgoOptions& ego = own.navigation.ego;
  const bool dvl = std::any_of(data.sensors.begin(), data.sensors.end(),
                               [](const EgoSensor& sensor) { return sensor.type == EgoSensorType::dvl; });
  if (ego.dvl_scale && ego.preintegrated_dvl)
    throw Error("--dvl-scale needs each velocity as a residual of its own: leave out --preintegrated-dvl");
  if (ego.dvl_scale && !dvl) throw Error("--dvl-scale needs a dvl, and there is none among the sensors in use");
  if (ego.preintegrated_dvl && !(dvl && data.imu))
    throw Error("--preintegrated-dvl needs a dvl and an imu among the sensors in use");
  if (own.navigation.vibration && !data.imu) throw Error("--vibration needs an imu among the sensors in use");
  if (own.no_earth_rotation) data.earth.rate.setZero();
}

}  // namespace tandem
