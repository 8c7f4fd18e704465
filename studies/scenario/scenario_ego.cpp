#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/scenario/scenario_ego.hpp>
#include <tandem/studies/scenario/sensor_entry.hpp>
#include <tandem/studies/scenario/sensor_file.hpp>
#include <tandem/studies/scenario/sensor_rows.hpp>
#include <tandem/studies/scenario/table.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr double kMinGravity = 9.7, kMaxGravity = 9.9;  // m/s²; on Earth it is 9.78 (equator) to 9.83 (poles)

EgoSensorType type_of(const YamlSection& entry) {
  const std::string given = entry.text("type");
  const auto types = ego_sensor_types();
  return *std::find_if(types.begin(), types.end(), [&](const EgoSensorTraits& type) { return type.name == given; });
}

std::string upper(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return result;
}

/// Reads a positive number, if the key exists or is required.
template <class Number>  // double, or an optional one
void read_positive(const YamlSection& entry, const std::string& key, Number& value, bool required = false) {
  if (!required && !entry.has(key)) return;
  const double given = entry.number(key);
  if (given <= 0) entry.fail(key, fmt::format("{} is {:g}; it must be above zero", key, given));
  value = given;
}

ImuSensor read_imu(const std::string& name, const YamlSection& entry, const std::filesystem::path& folder,
                   const Frame& frame, bool rows, const Stop& stop) {
  entry.allow_only({"type", "file", "position", "orientation", "accelerometer", "gyroscope", "accelerometer_bias_walk",
                    "gyroscope_bias_walk", "integration", "initial_accelerometer_bias", "initial_gyroscope_bias",
                    "max_gap", "max_specific_force", "max_angular_rate", "delay", "missing"});
  ImuSensor imu;
  imu.name = name;
  imu.mount = read_extrinsics(entry, frame);
  read_positive(entry, "accelerometer", imu.noise.accelerometer, true);
  read_positive(entry, "gyroscope", imu.noise.gyroscope, true);
  read_positive(entry, "accelerometer_bias_walk", imu.noise.accelerometer_bias_walk, true);
  read_positive(entry, "gyroscope_bias_walk", imu.noise.gyroscope_bias_walk, true);
  read_positive(entry, "integration", imu.noise.integration);
  read_positive(entry, "initial_accelerometer_bias", imu.initial_accelerometer_bias);
  read_positive(entry, "initial_gyroscope_bias", imu.initial_gyroscope_bias);
  read_positive(entry, "max_gap", imu.max_gap);
  read_positive(entry, "max_specific_force", imu.max_specific_force);
  read_positive(entry, "max_angular_rate", imu.max_angular_rate);
  const double delay = read_delay(entry, true);
  imu.missing = read_missing(entry);

  const std::filesystem::path file = sensor_file(entry, folder);
  if (!rows) {
    imu.set_delay(delay);
    return imu;
  }
  const Table table = read_sensor_rows(file, imu_columns, TimeOrder::any, stop);
  if (table.rows() < 2) throw Error(fmt::format("{} must have at least two samples", table.file.string()));
  imu.samples.reserve(table.rows());
  for (std::size_t i = 0; i < table.rows(); ++i) imu.samples.push_back(imu_sample(table.row(i), frame, imu.missing));
  imu.set_delay(delay);
  return imu;
}

EgoSensor read_other(const std::string& name, const YamlSection& entry, const std::filesystem::path& folder,
                     const Frame& frame, bool with_rows, const Stop& stop) {
  EgoSensor sensor{.name = name, .type = type_of(entry)};
  std::vector<std::string> keys = {"type", "file", "sigma", "delay", "loss", "error", "missing"};
  switch (sensor.type->mounting) {
    case EgoMounting::none:
      for (const char* key : {"position", "orientation"})
        if (entry.has(key))
          entry.fail(key, fmt::format("a {0} has no {1}, since its frame is the body frame; give the positions of the "
                                      "other sensors relative to the {2}",
                                      tandem::name(sensor.type), key, upper(tandem::name(sensor.type))));
      break;
    case EgoMounting::position:
      keys.push_back("position");
      break;
    case EgoMounting::orientation:
      keys.push_back("orientation");
      break;
  }
  entry.allow_only(keys);

  sensor.sigma.resize(rows(sensor.type));
  read_sigmas(entry, "sigma", {sensor.sigma.data(), std::size_t(sensor.sigma.size())});
  if (sensor.type->reading == EgoReading::world_vector && frame.is_ned()) std::swap(sensor.sigma[0], sensor.sigma[1]);
  sensor.mount = read_extrinsics(entry, frame);
  sensor.delay = read_delay(entry);
  sensor.loss = read_loss(entry, "loss");
  sensor.missing = read_missing(entry);
  sensor.error = read_error(entry, rows(sensor.type));
  if (sensor.error && sensor.error->has_bias() && sensor.type->reading == EgoReading::world_vector && frame.is_ned())
    std::swap(sensor.error->bias_sigma[0], sensor.error->bias_sigma[1]);

  const std::filesystem::path file = sensor_file(entry, folder);
  if (!with_rows) return sensor;
  const Table table = read_sensor_rows(file, columns(sensor.type), TimeOrder::any, stop);
  sensor.measurements.reserve(table.rows());
  for (std::size_t i = 0; i < table.rows(); ++i)
    sensor.measurements.push_back(
        with_location([&] { return table.where(i); },
                      [&] { return ego_measurement(sensor.type, table.row(i), frame, sensor.missing); }));
  return sensor;
}

}  // namespace

const std::vector<std::string>& ego_types() {
  static const std::vector<std::string> types = [] {
    std::vector<std::string> names = {"imu"};
    for (const EgoSensorTraits& type : ego_sensor_types()) names.emplace_back(type.name);
    return names;
  }();
  return types;
}

bool is_ego_sensor(const YamlSection& entry) {
  const auto& types = ego_types();
  return entry.has("type") && std::find(types.begin(), types.end(), entry.text("type")) != types.end();
}

void read_ego_sensor(const std::string& name, const YamlSection& entry, const std::filesystem::path& folder,
                     const Frame& frame, NavigationData& data, bool rows, const Stop& stop) {
  if (entry.text("type") != "imu") {
    data.sensors.push_back(read_other(name, entry, folder, frame, rows, stop));
    return;
  }
  if (data.imu)
    entry.fail("type", fmt::format("only one imu is supported; remove sensor {} or {}", data.imu->name, name));
  data.imu = read_imu(name, entry, folder, frame, rows, stop);
}

Earth read_earth(const YamlSection& yaml) {
  std::optional<double> latitude;  // rad
  if (yaml.has("latitude")) {
    const double degrees = yaml.number("latitude");
    if (std::abs(degrees) > 90)
      yaml.fail("latitude", fmt::format("latitude {:g} is outside [-90, 90] degrees", degrees));
    latitude = degrees * std::numbers::pi / 180;
  }
  double gravity = latitude ? Earth::normal_gravity(*latitude) : -Earth().gravity.z();
  if (yaml.has("gravity")) {
    gravity = yaml.number("gravity");
    if (gravity < 0)
      yaml.fail("gravity", fmt::format("gravity {:g} is negative; give its magnitude in m/s^2", gravity));
    if (gravity < kMinGravity || gravity > kMaxGravity)
      yaml.fail("gravity", fmt::format("gravity {:g} m/s^2 is outside [{}, {}] m/s^2, the range on Earth", gravity,
                                       kMinGravity, kMaxGravity));
  }
  return latitude ? Earth::at_latitude(*latitude, gravity) : Earth::with_gravity(gravity);
}

std::optional<std::pair<double, double>> time_span(const NavigationData& data) {
  std::optional<std::pair<double, double>> span;
  const auto add = [&](double t) {
    if (!span) span.emplace(t, t);
    span->first = std::min(span->first, t);
    span->second = std::max(span->second, t);
  };
  if (data.imu)
    for (const ImuSample& sample : data.imu->samples) add(sample.t);
  for (const EgoSensor& sensor : data.sensors)
    for (const EgoMeasurement& m : sensor.measurements) add(m.t);
  return span;
}

}  // namespace tandem
