#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/sensor_options.hpp>
#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/scenario/noise_file.hpp>
#include <tandem/studies/scenario/sensor_parameters.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

const std::string kOrientation = "orientation", kNoiseFrom = "--noise-from";

template <class T, class Parse>
SetByOption<T> parse_setting(const std::string& option, const std::string& text, Parse parse) {
  const auto [name, value] = parse_assignment(option, text);
  return {{option, name}, parse(fmt::format("{} {}", option, name), value)};
}

/// Parses NAME=VALUE or VALUE, which applies to all sensors.
template <class T, class Parse>
SetByOption<T> parse_setting_of_all(const std::string& option, const std::string& text, Parse parse) {
  if (text.find('=') == std::string::npos) return {{option, ""}, parse(option, text)};
  return parse_setting<T>(option, text, parse);
}

SystematicError parse_systematic_error(const std::string& option, const std::string& text) {
  const std::size_t colon = text.find(':');
  const std::vector<double> sigmas = parse_numbers(option, text.substr(0, colon));
  SystematicError error{Eigen::Map<const Eigen::VectorXd>(sigmas.data(), Eigen::Index(sigmas.size()))};
  if (colon != std::string::npos)
    error.correlation_time = parse_positive(option + ": the correlation time after ':'", text.substr(colon + 1));
  return error;
}

template <class Sensors>
auto find(Sensors& sensors, const std::string& name) {
  const auto at = std::find_if(sensors.begin(), sensors.end(), [&](const auto& sensor) { return sensor.name == name; });
  return at == sensors.end() ? nullptr : &*at;
}

[[noreturn]] void fail_unknown(const NamedByOption& what, const char* kind, const std::vector<std::string>& names) {
  throw Error(fmt::format("{}: unknown {} {}{} (available: {})", what.option, kind, quote(what.name),
                          did_you_mean(what.name, names), listed(names)));
}

/// Applies sensor options to the sensors of a scenario that are in use.
class Sensors {
 public:
  Sensors(Scenario& scenario, SensorsInUse in_use)
      : scenario_(scenario),
        target_(in_use.target ? &scenario.data : nullptr),
        own_(in_use.own ? &scenario.navigation.value() : nullptr) {}

  void leave_out(const NamedByOption& what) {
    if (is_imu(what.name)) {
      own_->imu.reset();
      scenario_.files.imu.reset();
    } else if (EgoSensor* const own = find_own(what.name)) {
      erase(own_->sensors, scenario_.files.ego, own);
    } else {
      erase(target_->sensors, scenario_.files.target, &target_sensor(what));
    }
  }

  void set(const SetByOption<std::vector<double>>& noise, bool separate_orientation) {
    if (set_number(noise, separate_orientation)) return;
    std::vector<NamedNoise> known;
    if (target_) known = named_noise(*target_);
    if (own_)
      for (EgoSensor& sensor : own_->sensors) {
        known.push_back({sensor.name, span(sensor.sigma)});
        if (sensor.error && sensor.error->has_bias())
          known.push_back({error_name(sensor.name), span(sensor.error->bias_sigma)});
      }
    std::array<double, 4> imu{};
    if (own_ && own_->imu) known.push_back({own_->imu->name, imu});
    const NamedNoise* const place = find(known, noise.name);
    if (!place) {
      // A noise file may name sensors of the scenario that this command does not use.
      if (noise.option.starts_with(kNoiseFrom) && is_in_scenario(noise.name)) return;
      std::vector<std::string> names;
      for (const NamedNoise& n : known) names.push_back(n.name);
      fail_unknown(noise, "noise", names);
    }
    const std::string reason = why_invalid_sigmas(noise.value, place->sigmas.size());
    if (!reason.empty())
      throw Error(fmt::format(
          "{} {} {}{}", noise.option, noise.name, reason,
          is_imu(noise.name) ? " (accelerometer, gyroscope, accelerometer_bias_walk, gyroscope_bias_walk)" : ""));
    std::copy(noise.value.begin(), noise.value.end(), place->sigmas.begin());
    if (is_imu(noise.name)) {
      ImuNoise& n = own_->imu->noise;
      n.accelerometer = imu[0];
      n.gyroscope = imu[1];
      n.accelerometer_bias_walk = imu[2];
      n.gyroscope_bias_walk = imu[3];
    }
    if (!own_) return;
    for (const EgoSensor& own : own_->sensors)
      if (own.name == noise.name || error_name(own.name) == noise.name) convert_axes(own, place->sigmas);
  }

  /// Sets a correlation time or degrees of freedom. Returns false if the name is not such a parameter of a sensor in
  /// use.
  bool set_number(const SetByOption<std::vector<double>>& noise, bool separate_orientation) {
    for (const SensorParameter& number : sensor_parameters(scenario_, {.separate_orientation = separate_orientation})) {
      if (number.name != noise.name) continue;
      const std::string sensor = number.name.substr(0, number.name.rfind('.'));
      if (!find_own(sensor) && !(target_ && find(target_->sensors, sensor))) return false;
      if (!number.settable) throw Error(fmt::format("{} {}: {}", noise.option, noise.name, number.why_not));
      if (noise.value.size() != 1 || !(noise.value[0] > 0) || !std::isfinite(noise.value[0]))
        throw Error(fmt::format("{} {} takes one positive number", noise.option, noise.name));
      number.set(noise.value[0]);
      return true;
    }
    return false;
  }

  void set(const SetByOption<Loss>& loss) {
    if (is_imu(loss.name))
      throw Error(fmt::format("{} {}: an imu cannot have a robust loss; use --without {} if its data are bad",
                              loss.option, loss.name, loss.name));
    if (EgoSensor* const own = find_own(loss.name)) {
      own->loss = loss.value;
      return;
    }
    NamedByOption sensor = loss;
    const bool orientation = sensor.name.ends_with("." + kOrientation);
    if (orientation) sensor.name.resize(sensor.name.size() - kOrientation.size() - 1);
    TargetSensor& found = target_sensor(sensor);
    if (orientation && found.type != SensorType::pose)
      throw Error(fmt::format("{} {}: {} measures no orientation", loss.option, loss.name, found.name));
    (orientation ? found.orientation_loss : found.loss) = loss.value;
  }

  void set(const SetByOption<double>& delay) {
    if (is_imu(delay.name)) {
      own_->imu->set_delay(delay.value);
      return;
    }
    if (delay.value < 0)
      throw Error(fmt::format("{} {} takes a non-negative number, not {:g}; only an imu may have a negative delay",
                              delay.option, printable(delay.name), delay.value));
    EgoSensor* const own = find_own(delay.name);
    (own ? own->delay : target_sensor(delay).delay) = delay.value;
  }

  void set(const SetByOption<SystematicError>& error) {
    if (const auto constant = constant_of(error.name)) return set_constant(error, *constant);
    EgoSensor* const own = find_own(error.name);
    if (is_imu(error.name))
      throw Error(
          fmt::format("{} {}: the biases of an imu are always estimated; set accelerometer_bias_walk and "
                      "gyroscope_bias_walk in scenario.yaml",
                      error.option, error.name));
    SystematicError value = error.value;
    const Eigen::VectorXd& sigma = own ? own->sigma : target_sensor(error).sigma;
    if (const auto why = why_invalid_sigmas(span(value.bias_sigma), std::size_t(sigma.size())); !why.empty())
      throw Error(fmt::format("{} {} {}", error.option, error.name, why));
    if (own) convert_axes(*own, span(value.bias_sigma));
    auto& place = own ? own->error : target_sensor(error).error;
    if (!place) place.emplace();
    place->bias_sigma = value.bias_sigma;
    place->correlation_time = value.correlation_time;
  }

  void hold_out(const SetByOption<int>& every) {
    if (every.value < 2)
      throw Error(fmt::format("{} takes 2 or more; 1 would hold out all measurements", every.option));
    const auto mark = [&](TargetSensor& sensor) {
      for (std::size_t i = 0; i < sensor.measurements.size(); ++i)
        sensor.measurements[i].held_out = (i + 1) % std::size_t(every.value) == 0;
    };
    if (!every.name.empty()) {
      const NamedByOption& what = every;
      TargetSensor* const sensor = find(target_->sensors, every.name);
      if (!sensor) fail_unknown(what, "sensor", target_names());
      return mark(*sensor);
    }
    for (TargetSensor& sensor : target_->sensors) mark(sensor);
  }

 private:
  /// Returns whether `name` is a noise or parameter of the scenario, including sensors that are not in use.
  bool is_in_scenario(const std::string& name) const {
    std::vector<std::string> names;
    if (!scenario_.data.sensors.empty())
      for (const NamedNoise& n : named_noise(scenario_.data)) names.push_back(n.name);
    if (scenario_.navigation)
      for (const EgoSensor& sensor : scenario_.navigation->sensors) {
        names.push_back(sensor.name);
        if (sensor.error && sensor.error->has_bias()) names.push_back(error_name(sensor.name));
      }
    for (const SensorParameter& number : sensor_parameters(scenario_, {})) names.push_back(number.name);
    return std::find(names.begin(), names.end(), name) != names.end();
  }
  /// A constant systematic error, e.g. "usbl.scale": the sensor name, and the member that holds its standard deviation.
  struct Constant {
    std::string sensor;
    double SystematicError::*sigma;
  };
  std::optional<Constant> constant_of(const std::string& name) const {
    const std::size_t dot = name.rfind('.');
    if (dot == std::string::npos || find_own(name) || (target_ && find(target_->sensors, name))) return {};
    for (const auto& [what, sigma] : {std::pair{".scale", &SystematicError::scale_sigma},
                                      {".misalignment", &SystematicError::misalignment_sigma},
                                      {".delay", &SystematicError::delay_sigma}})
      if (name.substr(dot) == what) return Constant{name.substr(0, dot), sigma};
    const std::string sensor = name.substr(0, dot);
    if (find_own(sensor) || (target_ && find(target_->sensors, sensor)))
      throw Error(
          fmt::format("unknown constant {}; a sensor has {}.scale, .misalignment and .delay", printable(name), sensor));
    return {};
  }
  void set_constant(const SetByOption<SystematicError>& error, const Constant& constant) {
    const Eigen::VectorXd& sigma = error.value.bias_sigma;
    if (sigma.size() != 1 || std::isfinite(error.value.correlation_time) || !(sigma[0] > 0) || !std::isfinite(sigma[0]))
      throw Error(fmt::format("{} {} is constant; give one positive standard deviation without a correlation time",
                              error.option, error.name));
    const NamedByOption sensor{error.option, constant.sensor};
    EgoSensor* const own = find_own(constant.sensor);
    if (is_imu(constant.sensor))
      throw Error(
          fmt::format("{} {}: not supported for an imu; set its delay by --delay {}=SECONDS, or estimate it by tandem "
                      "navigate --fit-delay {}",
                      error.option, error.name, constant.sensor, constant.sensor));
    auto& place = own ? own->error : target_sensor(sensor).error;
    if (!place) place.emplace();
    if (error.option == "--free" && (*place).*constant.sigma > 0) return;  // keeps the value of the scenario
    (*place).*constant.sigma = sigma[0];
  }
  static std::span<double> span(Eigen::VectorXd& v) { return {v.data(), static_cast<std::size_t>(v.size())}; }
  /// Converts standard deviations along world axes from the frame of the files to ENU.
  void convert_axes(const EgoSensor& own, std::span<double> sigmas) const {
    if (own.type->reading == EgoReading::world_vector && scenario_.frame.is_ned()) std::swap(sigmas[0], sigmas[1]);
  }
  template <class Sensor>
  static void erase(std::vector<Sensor>& sensors, std::vector<std::filesystem::path>& files, const Sensor* sensor) {
    const auto i = sensor - sensors.data();
    sensors.erase(sensors.begin() + i);
    if (std::size_t(i) < files.size()) files.erase(files.begin() + i);
  }
  bool is_imu(const std::string& name) const { return own_ && own_->imu && own_->imu->name == name; }
  EgoSensor* find_own(const std::string& name) const { return own_ ? find(own_->sensors, name) : nullptr; }
  TargetSensor& target_sensor(const NamedByOption& what) const {
    if (target_)
      if (TargetSensor* const sensor = find(target_->sensors, what.name)) return *sensor;
    fail_unknown(what, "sensor", names());
  }
  std::vector<std::string> target_names() const {
    std::vector<std::string> names;
    if (target_)
      for (const TargetSensor& sensor : target_->sensors) names.push_back(sensor.name);
    return names;
  }
  std::vector<std::string> names() const {
    std::vector<std::string> names = target_names();
    if (own_ && own_->imu) names.push_back(own_->imu->name);
    if (own_)
      for (const EgoSensor& sensor : own_->sensors) names.push_back(sensor.name);
    return names;
  }

  Scenario& scenario_;
  TrackingData* target_;
  NavigationData* own_;
};

/// Returns the last loss given for a sensor, or, with an empty name, for all measurements.
std::optional<Loss> last_loss(const std::vector<SetByOption<Loss>>& losses, const std::string& name) {
  std::optional<Loss> result;
  for (const auto& loss : losses)
    if (loss.name == name) result = loss.value;
  return result;
}

/// Throws Error if degrees of freedom are given for a sensor whose --loss has none. Otherwise one of the two would be
/// ignored silently.
void reject_conflicting_losses(const SensorOptions& options) {
  for (const auto& number : options.noise) {
    if (!number.name.ends_with(".dof")) continue;
    const std::string sensor = number.name.substr(0, number.name.size() - 4);
    const auto loss = last_loss(options.losses, sensor);
    if (loss && loss->kind != Loss::Kind::student_t)
      throw Error(
          fmt::format("{} {}: degrees of freedom need a student-t loss, but --loss {}={} is given; remove one of them",
                      number.option, number.name, sensor, loss_text(*loss)));
  }
}

}  // namespace

std::optional<Loss> SensorOptions::loss() const { return last_loss(losses, ""); }
std::optional<Loss> SensorOptions::orientation_loss() const { return last_loss(losses, kOrientation); }

NamedByOption parse_name(const std::string& option, const std::string& text) { return {option, text}; }

void add_sensors(CommandOptions& option, SensorOptions& sensors) {
  option.group("Sensors");
  option.advanced();
  option.repeatable("--without", "SENSOR", "Do not use SENSOR", sensors.without, parse_name);
  option.set_repeatedly(
      kNoiseFrom, "FILE",
      "Use the noise that tandem calibrate wrote to FILE. It overrides --error and --loss; --noise overrides it",
      [&sensors](const std::string& name, const std::string& text) {
        for (NoiseEntry& entry : read_noise_file(text))
          sensors.noise.push_back({{fmt::format("{} {}", name, text), entry.name}, entry.sigmas});
      });
  option.everyday();
  option.repeatable("--noise", "NAME=v,v,...",
                    "Standard deviations of a sensor or other noise entry. They replace those of scenario.yaml "
                    "and have the same "
                    "units. For an imu: accelerometer, gyroscope and their bias walks",
                    sensors.noise, [](const std::string& name, const std::string& text) {
                      return parse_setting<std::vector<double>>(name, text, parse_numbers);
                    });
  option.repeatable("--loss", "[WHICH=]NAME[:SCALE]",
                    fmt::format("Robust loss of WHICH (default: all measurements): {}. SCALE is in standard deviations "
                                "(default 1); for student-t, SCALE squared is the degrees of freedom plus the rows. "
                                "WHICH is a sensor, SENSOR.orientation or orientation (of all sensors)",
                                listed(loss_names(), "or")),
                    sensors.losses, [](const std::string& name, const std::string& text) {
                      return parse_setting_of_all<Loss>(
                          name, text, [&](const std::string&, const std::string& t) { return parse_loss(name, t); });
                    });
  option.repeatable(
      "--delay", "SENSOR=SECONDS",
      "A row stamped t was valid at t - SECONDS. Replaces the delay in scenario.yaml; negative only for an imu",
      sensors.delays,
      [](const std::string& name, const std::string& text) { return parse_setting<double>(name, text, parse_finite); });
  option.advanced();
  option.repeatable(
      "--error", "SENSOR[.scale|.misalignment|.delay]=v,v,...[:SECONDS]",
      "Estimate a systematic error with these prior standard deviations: a bias with correlation time SECONDS [s] "
      "(default: constant), or a constant scale factor, misalignment [rad] or delay [s]",
      sensors.errors, [](const std::string& name, const std::string& text) {
        return parse_setting<SystematicError>(name, text, parse_systematic_error);
      });
}

void add_hold_out(CommandOptions& option, SensorOptions& sensors) {
  option.group("Sensors");
  option.repeatable("--hold-out", "[SENSOR=]N", "Hold out every N-th measurement for validation", sensors.hold_out,
                    [](const std::string& name, const std::string& text) {
                      return parse_setting_of_all<int>(name, text, parse_count);
                    });
}

void apply(const SensorOptions& options, SensorsInUse in_use, Scenario& scenario) {
  Sensors sensors(scenario, in_use);
  reject_conflicting_losses(options);
  for (const auto& error : options.errors) sensors.set(error);
  for (const auto& loss : options.losses) {
    const bool of_all = loss.name.empty() || (in_use.target && loss.name == kOrientation);
    if (!of_all) sensors.set(loss);
  }
  // --without is applied last, so that options for a removed sensor are checked too.
  convert_noise_axes(scenario.data.noise, scenario.frame);  // --noise is along the axes of the files
  for (const auto& noise : options.noise) sensors.set(noise, options.orientation_loss().has_value());
  convert_noise_axes(scenario.data.noise, scenario.frame);
  for (const auto& delay : options.delays) sensors.set(delay);
  for (const auto& every : options.hold_out) sensors.hold_out(every);
  for (const auto& sensor : options.without) sensors.leave_out(sensor);
}

void check_delay_is_fixed(const NavigationData& data, const NamedByOption& what) {
  std::vector<std::string> names;
  if (data.imu) names.push_back(data.imu->name);
  for (const EgoSensor& sensor : data.sensors) names.push_back(sensor.name);
  if (std::find(names.begin(), names.end(), what.name) == names.end()) fail_unknown(what, "sensor", names);
  for (const EgoSensor& sensor : data.sensors)
    if (sensor.name == what.name && sensor.error && sensor.error->delay_sigma > 0)
      throw Error(fmt::format(
          "{} {}: the delay is already estimated as a systematic error (--error {}.delay); remove one of them",
          what.option, what.name, what.name));
}

}  // namespace tandem
