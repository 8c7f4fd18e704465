#include <algorithm>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/tracking_arguments.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// A word before '=' and what comes after it; the word is empty when there is none.
std::pair<std::string, std::string> assigned(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) return {"", text};
  return {text.substr(0, equals), text.substr(equals + 1)};
}

TargetSensor& find_sensor(TrackingData& data, const std::string& option, const std::string& name) {
  std::vector<std::string> names;
  for (TargetSensor& sensor : data.sensors) {
    if (sensor.name == name) return sensor;
    names.push_back(sensor.name);
  }
  throw Error(
      fmt::format("{} knows no sensor {}{} (here: {})", option, quote(name), did_you_mean(name, names), listed(names)));
}

/// "SENSOR=NAME:SCALE" or "SENSOR.orientation=NAME:SCALE".
void set_loss(TrackingData& data, const std::string& argument) {
  auto [where, value] = assigned(argument);
  if (where.empty() || where == "orientation") return;  // of all sensors: tracking_options
  static const std::string suffix = ".orientation";
  const bool orientation = where.ends_with(suffix);
  if (orientation) where.resize(where.size() - suffix.size());
  TargetSensor& sensor = find_sensor(data, "--loss", where);
  if (orientation && sensor.type != SensorType::pose)
    throw Error(fmt::format("--loss {}: {} measures no orientation", argument, sensor.name));
  (orientation ? sensor.orientation_loss : sensor.loss) = parse_loss("--loss", value);
}

/// "SENSOR=NAME:SCALE" of one of the chaser's own sensors; false when there is none of that name.
bool set_own_loss(NavigationData& data, const std::string& argument) {
  const auto [name, value] = assigned(argument);
  for (EgoSensor& sensor : data.sensors) {
    if (sensor.name != name) continue;
    sensor.loss = parse_loss("--loss", value);
    return true;
  }
  return false;
}

void override_noises(Scenario& scenario, const std::vector<std::string>& assignments) {
  turn_noise(scenario.data.noise, scenario.frame);  // along the files' axes, as in scenario.yaml
  for (const std::string& assignment : assignments) override_noise(scenario.data, assignment);
  turn_noise(scenario.data.noise, scenario.frame);
}

/// "N" or "SENSOR=N": every N-th measurement.
void hold_out(TrackingData& data, const std::string& argument) {
  const auto [name, value] = assigned(argument);
  const int every = parse_count("--hold-out", value);
  if (every < 2) throw Error("--hold-out 1 would leave no measurement; hold out every second one at most");
  const auto mark = [&](TargetSensor& sensor) {
    for (std::size_t i = 0; i < sensor.measurements.size(); ++i)
      sensor.measurements[i].held_out = (i + 1) % std::size_t(every) == 0;
  };
  if (!name.empty()) return mark(find_sensor(data, "--hold-out", name));
  for (TargetSensor& sensor : data.sensors) mark(sensor);
}

}  // namespace

TrackingOptions tracking_options(const TrackingArguments& arguments) {
  TrackingOptions options;
  if (arguments.mode) options.mode = parse_mode("--mode", *arguments.mode);
  if (arguments.model) options.model = parse_model("--model", *arguments.model);
  if (arguments.junction) options.junction = parse_junction("--junction", *arguments.junction);
  if (arguments.horizons) options.horizons = parse_horizons("--horizons", *arguments.horizons);
  if (arguments.roll_pitch) options.roll_pitch = parse_role("--roll-pitch", *arguments.roll_pitch);
  if (arguments.non_holonomic) options.non_holonomic = parse_role("--non-holonomic", *arguments.non_holonomic);
  if (arguments.surge) options.surge = parse_interval("--surge", *arguments.surge);
  if (arguments.yaw_rate) options.max_yaw_rate = parse_magnitude("--yaw-rate", *arguments.yaw_rate);
  if (arguments.limits) options.limits = parse_limits("--limits", *arguments.limits);
  if (arguments.limits && !options.surge && !options.max_yaw_rate)
    throw Error("--limits says how --surge and --yaw-rate are held; give one of them too");
  if (arguments.robust) make_robust(options);
  for (const std::string& argument : arguments.loss) {
    const auto [where, value] = assigned(argument);
    if (where.empty()) options.loss = parse_loss("--loss", value);
    if (where == "orientation") options.orientation_loss = parse_loss("--loss", value);
  }
  if (arguments.max_keyframes)
    options.max_keyframes = static_cast<std::size_t>(parse_count("--max-keyframes", *arguments.max_keyframes));
  return options;
}

Scenario scenario_with(const TrackingArguments& arguments) {
  Scenario scenario = read_scenario(find_scenario(arguments.scenario, builtin_scenarios()));
  if (scenario.navigation && scenario.data.sensors.empty())
    throw Error(fmt::format("{} has no sensor that sees a target: for its own trajectory use tandem navigate",
                            arguments.scenario));
  override_noises(scenario, arguments.noise);
  for (const std::string& argument : arguments.loss) set_loss(scenario.data, argument);
  for (const std::string& argument : arguments.hold_out) hold_out(scenario.data, argument);
  return scenario;
}

Scenario settings_with(const TrackingArguments& arguments, RowsIn rows) {
  Scenario scenario = read_settings(find_scenario(arguments.scenario, builtin_scenarios()), rows);
  override_noises(scenario, arguments.noise);
  for (const std::string& argument : arguments.loss)
    if (!scenario.navigation || !set_own_loss(*scenario.navigation, argument)) set_loss(scenario.data, argument);
  return scenario;
}

}  // namespace tandem
