#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/scenario/quaternion.hpp>
#include <tandem/studies/scenario/sensor_entry.hpp>
#include <tandem/studies/support/option_values.hpp>

namespace tandem {

SE3 read_extrinsics(const YamlSection& sensor, const Frame& frame, const std::string& prefix) {
  const std::string position = prefix + "position", orientation = prefix + "orientation";
  Vector<3> t = Vector<3>::Zero();
  SO3 R;
  if (sensor.has(position)) t = Vector<3>(sensor.numbers(position, 3).data());
  if (sensor.has(orientation)) {
    const std::vector<double> xyzw = sensor.numbers(orientation, 4);
    const auto rotation = rotation_from(xyzw.data());
    if (!rotation) sensor.fail(orientation, quaternion_error(xyzw.data()));
    R = *rotation;
  }
  return frame.body(SE3(R, t));
}

double read_delay(const YamlSection& sensor, bool allow_negative) {
  if (!sensor.has("delay")) return 0;
  const double delay = sensor.number("delay");
  if (delay < 0 && !allow_negative)
    sensor.fail("delay", fmt::format("delay {:g} s is negative; only an imu may have a negative delay", delay));
  return delay;
}

std::optional<SystematicError> read_error(const YamlSection& sensor, int rows) {
  if (!sensor.has("error")) return {};
  const YamlSection entry = sensor.section("error");
  entry.allow_only({"sigma", "time", "scale", "misalignment", "delay"});
  SystematicError error;
  if (entry.has("sigma")) {
    error.bias_sigma.resize(rows);
    read_sigmas(entry, "sigma", {error.bias_sigma.data(), std::size_t(rows)});
  }
  for (const auto& [key, sigma] : {std::pair{"scale", &error.scale_sigma},
                                   {"misalignment", &error.misalignment_sigma},
                                   {"delay", &error.delay_sigma}})
    if (entry.has(key)) read_sigmas(entry, key, {sigma, 1});
  if (!error.has_bias() && !error.has_constants())
    sensor.fail("error", "error is empty; give sigma (of a bias), scale, misalignment or delay");
  if (entry.has("time") && !error.has_bias())
    entry.fail("time", "time is the correlation time of a bias; give sigma (of the bias) too, or remove time");
  if (entry.has("time")) error.correlation_time = entry.number("time");
  if (!(error.correlation_time > 0))
    entry.fail("time", "time must be above zero; it is the correlation time of the bias in seconds");
  return error;
}

std::vector<double> read_missing(const YamlSection& sensor) {
  return sensor.has("missing") ? sensor.numbers("missing") : std::vector<double>();
}

std::optional<Loss> read_loss(const YamlSection& sensor, const std::string& key) {
  if (!sensor.has(key)) return {};
  try {
    return parse_loss(key, sensor.text(key));
  } catch (const Error& error) {
    sensor.fail(key, error.what());
  }
}

}  // namespace tandem
