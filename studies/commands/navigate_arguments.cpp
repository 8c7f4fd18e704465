#include <algorithm>
#include <array>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/navigate_arguments.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/scenario/scenario_ego.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

std::vector<std::string> sensor_names(const NavigationData& data) {
  std::vector<std::string> names;
  if (data.imu) names.push_back(data.imu->name);
  for (const EgoSensor& sensor : data.sensors) names.push_back(sensor.name);
  return names;
}

[[noreturn]] void fail_unknown(const std::string& option, const std::string& name, const NavigationData& data) {
  const std::vector<std::string> names = sensor_names(data);
  throw Error(
      fmt::format("{} knows no sensor {}{} (here: {})", option, quote(name), did_you_mean(name, names), listed(names)));
}

EgoSensor* find(NavigationData& data, const std::string& name) {
  const auto at = std::find_if(data.sensors.begin(), data.sensors.end(),
                               [&](const EgoSensor& sensor) { return sensor.name == name; });
  return at == data.sensors.end() ? nullptr : &*at;
}

bool is_imu(const NavigationData& data, const std::string& name) { return data.imu && data.imu->name == name; }

/// "SENSOR=v,v": standard deviations as in scenario.yaml; of the IMU its four densities.
void override_noise(NavigationData& data, const Frame& frame, const std::string& argument) {
  const auto [name, text] = parse_assignment("--noise", argument);
  std::vector<double> values;
  for (const std::string_view part : split(text, ',')) {
    const auto value = parse_number(part);
    if (!value) throw Error(fmt::format("--noise {}: {} is not a number", name, quote(part)));
    values.push_back(*value);
  }
  EgoSensor* const sensor = find(data, name);
  if (!sensor && !is_imu(data, name)) fail_unknown("--noise", name, data);
  const std::string reason = why_not_sigmas(values, sensor ? std::size_t(rows(sensor->type)) : 4);
  if (!reason.empty())
    throw Error(fmt::format("--noise {} {}{}", name, reason,
                            sensor ? "" : " (accelerometer, gyroscope, their bias walks: as in scenario.yaml)"));
  if (sensor) {
    sensor->sigma = Eigen::Map<const Eigen::VectorXd>(values.data(), Eigen::Index(values.size()));
    if (sensor->type == EgoSensorType::gps && frame.is_ned()) std::swap(sensor->sigma[0], sensor->sigma[1]);
    return;
  }
  ImuNoise& noise = data.imu->noise;
  noise.accelerometer = values[0];
  noise.gyroscope = values[1];
  noise.accelerometer_bias_walk = values[2];
  noise.gyroscope_bias_walk = values[3];
}

/// "SENSOR=NAME:SCALE"; without a sensor it is of all, see navigation_options.
void set_loss(NavigationData& data, const std::string& argument) {
  if (argument.find('=') == std::string::npos) return;
  const auto [name, text] = parse_assignment("--loss", argument);
  if (is_imu(data, name))
    throw Error(fmt::format("--loss {}: what the imu reads has no loss; leave it out with --without {} instead",
                            argument, name));
  EgoSensor* const sensor = find(data, name);
  if (!sensor) fail_unknown("--loss", name, data);
  sensor->loss = parse_loss("--loss", text);
}

/// The sensor of an option about delays.
EgoSensor& delayed(NavigationData& data, const std::string& option, const std::string& name) {
  if (is_imu(data, name)) throw Error(fmt::format("{} {}: delays are against the imu's own time", option, name));
  EgoSensor* const sensor = find(data, name);
  if (!sensor) fail_unknown(option, name, data);
  return *sensor;
}

}  // namespace

NavigationOptions navigation_options(const NavigationArguments& arguments) {
  NavigationOptions options;
  options.ego.dvl_scale = arguments.dvl_scale;
  options.ego.preintegrated_dvl = arguments.preintegrated_dvl;
  if (arguments.dvl_scale && arguments.preintegrated_dvl)
    throw Error("--dvl-scale needs each velocity as a residual of its own: leave out --preintegrated-dvl");
  for (const std::string& argument : arguments.loss)
    if (argument.find('=') == std::string::npos) options.ego.loss = parse_loss("--loss", argument);
  if (arguments.alignment) options.alignment = parse_magnitude("--alignment", *arguments.alignment);
  return options;
}

Scenario scenario_to_navigate(const NavigationArguments& arguments) {
  Scenario scenario = read_scenario(find_scenario(arguments.scenario, builtin_scenarios()));
  if (!scenario.navigation)
    throw Error(
        fmt::format("{} has no sensor of the chaser's own: sensors in scenario.yaml of the types {}; for chaser "
                    "and target by odometry use tandem estimate",
                    arguments.scenario, listed(ego_types(), "or")));
  NavigationData& data = *scenario.navigation;
  for (const std::string& argument : arguments.noise) override_noise(data, scenario.frame, argument);
  for (const std::string& argument : arguments.loss) set_loss(data, argument);
  for (const std::string& argument : arguments.delay) {
    const auto [name, text] = parse_assignment("--delay", argument);
    delayed(data, "--delay", name).delay = parse_magnitude("--delay", text);
  }
  if (arguments.keyframe_interval) {
    data.keyframe_interval = parse_magnitude("--keyframe-interval", *arguments.keyframe_interval);
    if (data.keyframe_interval <= kSameInstant)
      throw Error(fmt::format("--keyframe-interval is in seconds and above 0.001, not {}",
                              quote(*arguments.keyframe_interval)));
  }
  if (arguments.no_earth_rotation) data.earth.rate.setZero();
  return scenario;
}

std::vector<std::size_t> delays_to_fit(const NavigationData& data, const NavigationArguments& arguments) {
  NavigationData known = data;
  std::vector<std::size_t> sensors;
  for (const std::string& name : arguments.fit_delay)
    sensors.push_back(std::size_t(&delayed(known, "--fit-delay", name) - known.sensors.data()));
  return sensors;
}

NavigationData sensors_in_use(const Scenario& scenario, const NavigationArguments& arguments) {
  NavigationData data = scenario.navigation.value();
  for (const std::string& name : arguments.without) {
    const std::vector<std::string> known = sensor_names(*scenario.navigation);
    if (std::find(known.begin(), known.end(), name) == known.end())
      fail_unknown("--without", name, *scenario.navigation);
    if (is_imu(data, name)) data.imu.reset();
    std::erase_if(data.sensors, [&](const EgoSensor& sensor) { return sensor.name == name; });
  }
  const bool dvl = std::any_of(data.sensors.begin(), data.sensors.end(),
                               [](const EgoSensor& sensor) { return sensor.type == EgoSensorType::dvl; });
  if (arguments.dvl_scale && !dvl) throw Error("--dvl-scale needs a dvl, and there is none among the sensors in use");
  if (arguments.preintegrated_dvl && !(dvl && data.imu))
    throw Error("--preintegrated-dvl needs a dvl and an imu among the sensors in use");
  return data;
}

}  // namespace tandem
