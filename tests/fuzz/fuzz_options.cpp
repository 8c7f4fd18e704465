#include <cmath>

#include <tandem/studies/commands/sensor_options.hpp>
#include <tandem/studies/comparison/compare.hpp>
#include <tandem/studies/comparison/models.hpp>
#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/support/option_values.hpp>

#include "fuzz/input.hpp"

namespace {

using namespace tandem;

/// Scenario with target sensors and sensors of the chaser.
const Scenario& scenario() {
  static const Scenario read = read_settings(
      "name: both\n"
      "noise: {constant_twist: [1, 1, 1, 1, 1, 1]}\n"
      "sensors:\n"
      "  usbl: {type: position, file: usbl.csv, sigma: [1, 1, 1]}\n"
      "  camera: {type: pose, file: camera.csv, sigma: [1, 1, 1, 1, 1, 1]}\n"
      "  imu: {type: imu, file: imu.csv, accelerometer: 1, gyroscope: 1, accelerometer_bias_walk: 1,\n"
      "    gyroscope_bias_walk: 1}\n"
      "  gps: {type: gps, file: gps.csv, sigma: [1, 1, 1]}\n",
      "/", RowsIn::stream);
  return read;
}

/// Parses an option for one sensor, such as "usbl=1,2,3", and applies it to the scenario.
template <class T, class Parse>
void set_sensor(std::vector<SetByOption<T>> SensorOptions::*options, const std::string& option, const std::string& text,
                Parse parse) {
  const auto [name, value] = parse_assignment(option, text);
  SensorOptions sensors;
  (sensors.*options).push_back({{option, name}, parse(option, value)});
  Scenario changed = scenario();
  apply(sensors, {true, true}, changed);
  for (const NamedNoise& noise : named_noise(changed.data))
    for (const double sigma : noise.sigmas)  // zero if neither the option nor a default sets it
      fuzz::expect(std::isfinite(sigma) && sigma >= 0, "standard deviations are finite");
}

void expect_models(const std::vector<NamedModel>& models) {
  fuzz::expect(!models.empty(), "a list has at least one model");
  for (const NamedModel& model : models) {
    for (const Horizon& horizon : model.options.horizons)
      fuzz::expect(horizon.back > 0 && horizon.ahead > 0, "horizons are at least one keyframe");
    solver_for(model);
  }
}

/// Parses a value of the type that `which` selects.
void parse(std::size_t which, const std::string& text) {
  switch (which) {
    case 0:
      for (const Horizon& h : parse_horizons("--horizons", text))
        fuzz::expect(h.back > 0 && h.ahead > 0, "horizons are at least one keyframe");
      return;
    case 1: {
      const Bounds<1> bounds = parse_interval("--surge", text);
      fuzz::expect(bounds.lower[0] <= bounds.upper[0], "an interval is not empty");
      return;
    }
    case 2: {
      const Loss loss = parse_loss("--loss", text);
      fuzz::expect(loss.scale > 0 && std::isfinite(loss.scale), "the scale of a loss is positive and finite");
      return;
    }
    case 3:
      fuzz::expect(parse_count("--max-keyframes", text) > 0, "a count is above zero");
      return;
    case 4:
      fuzz::expect(std::isfinite(parse_non_negative("--yaw-rate", text)), "a magnitude is finite");
      return;
    case 5: {
      const auto [key, value] = parse_assignment("--solver-option", text);
      fuzz::expect(key + "=" + value == text, "an assignment keeps its text");
      return;
    }
    case 6:
      return expect_models(parse_model_list("--models", text, {}));
    case 7:
      return expect_models({parse_model_spec("--models", text, {})});
    case 8:
      fuzz::expect(!parse_solver_list("--solvers", text).empty(), "a list has at least one solver");
      return;
    case 9:
      fuzz::expect(!parse_constraints("--constraints", text).empty(), "a list has at least one role");
      return;
    case 10:
      return set_sensor(&SensorOptions::noise, "--noise", text, parse_numbers);
    case 11:
      parse_solver("--solver", text);
      return;
    case 12:
      parse_role("--roll-pitch", text);
      return;
    case 13:
      parse_limits("--limits", text);
      return;
    case 14:
      parse_mode("--mode", text);
      return;
    case 15:
      parse_model("--model", text);
      return;
    case 16:
      parse_junction("--junction", text);
      return;
    case 17:
      parse_hessian("--hessian", text);
      return;
    case 18:
      return set_sensor(&SensorOptions::losses, "--loss", text, parse_loss);
    case 19:
      return set_sensor(&SensorOptions::delays, "--delay", text, parse_finite);
    case 20:
      return set_sensor(&SensorOptions::hold_out, "--hold-out", text, parse_count);
    case 21: {
      Scenario changed = scenario();
      SensorOptions sensors;
      sensors.without.push_back(parse_name("--without", text));
      return apply(sensors, {true, true}, changed);
    }
    default:
      parse_plots("--plots", text);
  }
}

}  // namespace

// Values of command-line options; the first byte selects the option.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const std::size_t which = input.below(23);
  const std::string text = input.text();
  fuzz::accepts([&] { parse(which, text); });
  return 0;
}
