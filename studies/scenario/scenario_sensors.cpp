#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/scenario/scenario_ego.hpp>
#include <tandem/studies/scenario/scenario_sensors.hpp>
#include <tandem/studies/scenario/sensor_entry.hpp>
#include <tandem/studies/scenario/sensor_file.hpp>
#include <tandem/studies/scenario/sensor_rows.hpp>
#include <tandem/studies/scenario/table.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

std::vector<Measurement> measurements(const TargetSensor& sensor, const std::filesystem::path& file,
                                      const SensorContext& context) {
  const SensorType type = sensor.type;
  std::vector<Measurement> result;
  if (!context.rows) return result;
  const Table table =
      read_sensor_rows(file, columns(type, context.planar),
                       may_repeat_times(type) ? TimeOrder::repeating : TimeOrder::increasing, context.stop);
  for (std::size_t i = 0; i < table.rows(); ++i) {
    if (table.t(i) < context.first - kSameInstant || table.t(i) > context.last + kSameInstant)
      throw Error(fmt::format("{}: time {} is outside the time span of {}, {} to {} s", table.where(i), table.t(i),
                              context.span_of, context.first, context.last));
    result.push_back(with_location(
        [&] { return table.where(i); },
        [&] { return target_measurement(type, table.row(i), context.frame, context.planar, sensor.missing); }));
  }
  return result;
}

}  // namespace

SensorType sensor_type(const YamlSection& entry) {
  const std::string given = entry.text("type");
  std::vector<std::string> known;
  for (const SensorTraits& type : sensor_types()) {
    known.emplace_back(type.name);
    if (type.name == given) return type;
  }
  const std::vector<std::string>& ego = ego_types();
  known.insert(known.end(), ego.begin(), ego.end());
  entry.fail("type", fmt::format("unknown sensor type {}{}", quote(given), did_you_mean(given, known)));
}

TargetSensor read_sensor(const std::string& name, const YamlSection& entry, const SensorContext& context) {
  TargetSensor sensor;
  sensor.name = name;
  sensor.type = sensor_type(entry);
  const int n = rows(sensor.type, context.planar);
  if (n == 0)
    entry.fail("type", fmt::format("sensor type {} is not supported with group SE2; use {}", sensor.type->name,
                                   sensor.type->has(measured::range) ? "range_bearing" : "group SE3"));
  std::vector<std::string> keys = {"type",  "file", "sigma", "position", "orientation", "target_position",
                                   "delay", "loss", "error", "missing"};
  if (sensor.type->has(measured::rotation)) keys.insert(keys.end(), {"target_orientation", "orientation_loss"});
  entry.allow_only(keys);

  sensor.sigma.resize(n);
  read_sigmas(entry, "sigma", {sensor.sigma.data(), std::size_t(n)});
  sensor.mount = read_extrinsics(entry, context.frame);
  sensor.marker = read_extrinsics(entry, context.frame, "target_");
  sensor.delay = read_delay(entry);
  sensor.loss = read_loss(entry, "loss");
  sensor.orientation_loss = read_loss(entry, "orientation_loss");
  sensor.error = read_error(entry, n);
  sensor.missing = read_missing(entry);
  sensor.measurements = measurements(sensor, sensor_file(entry, context.folder), context);
  return sensor;
}

TargetSensor read_undeclared_sensor(const std::string& name, SensorType type, const SensorContext& context) {
  TargetSensor sensor;
  sensor.name = name;
  sensor.type = type;
  sensor.sigma = Eigen::VectorXd::Zero(rows(type, context.planar));
  sensor.measurements = measurements(sensor, file_in(context.folder, name + ".csv"), context);
  return sensor;
}

}  // namespace tandem
