#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/named_noise.hpp>
#include <tandem/studies/scenario_ego.hpp>
#include <tandem/studies/scenario_sensors.hpp>
#include <tandem/studies/sensor_entry.hpp>
#include <tandem/studies/table.hpp>
#include <tandem/studies/text.hpp>

namespace tandem {
namespace {

constexpr double kPole = 1e-6;  // rad: this close to straight up, an azimuth means nothing

/// Columns of a sensor's file.
std::string header(SensorType type, bool planar) {
  switch (type) {
    case SensorType::position:
      return planar ? "t,x,y" : "t,x,y,z";
    case SensorType::pose:
      return planar ? "t,x,y,yaw" : "t,x,y,z,qx,qy,qz,qw";
    case SensorType::range_bearing:
      return planar ? "t,range,bearing" : "t,range,azimuth,elevation";
    case SensorType::bearing:
      return planar ? "t,bearing" : "t,azimuth,elevation";
    case SensorType::range:
      return "t,range";
    case SensorType::usbl_spherical:
      break;
  }
  return "t,range,azimuth,elevation";
}

/// Turns the rows of a file into measurements, in the frame that is used inside.
class RowReader {
 public:
  RowReader(SensorType type, const Table& table, const SensorSurroundings& around)
      : type_(type), table_(table), frame_(around.frame), planar_(around.planar) {}

  Measurement read(std::size_t i) const {
    Measurement m;
    m.t = table_.t(i);
    const double* row = table_.row(i) + 1;
    switch (type_) {
      case SensorType::position:
        m.position = frame_.body(point(row));
        break;
      case SensorType::pose:
        m.position = frame_.body(point(row));
        m.rotation = frame_.body(planar_ ? SO3::Exp({0, 0, row[2]}) : rotation_at(table_, i, row + 3));
        break;
      case SensorType::range_bearing:
      case SensorType::usbl_spherical:
        m.range = range(i, row[0]);
        directions(i, row + 1, m);
        break;
      case SensorType::bearing:
        directions(i, row, m);
        break;
      case SensorType::range:
        m.range = range(i, row[0]);
        break;
    }
    return m;
  }

 private:
  Vector<3> point(const double* row) const { return planar_ ? Vector<3>(row[0], row[1], 0) : Vector<3>(row); }

  double range(std::size_t i, double value) const {
    if (value > 0) return value;
    throw Error(fmt::format("{}: range {:g} m; a range must be above zero", table_.where(i), value));
  }

  void directions(std::size_t i, const double* row, Measurement& m) const {
    if (std::abs(row[0]) > 2 * std::numbers::pi)
      throw Error(fmt::format("{}: {} {:g} is beyond two pi; angles are in radians", table_.where(i),
                              planar_ ? "bearing" : "azimuth", row[0]));
    m.azimuth = frame_.angle(row[0]);
    if (planar_) return;
    const double from_pole = 0.5 * std::numbers::pi - std::abs(row[1]);
    if (from_pole < -kPole)
      throw Error(fmt::format("{}: elevation {:g} rad is beyond the pole of its chart (pi/2); angles are in radians",
                              table_.where(i), row[1]));
    if (type_ == SensorType::usbl_spherical && from_pole < kPole)
      throw Error(
          fmt::format("{}: elevation {:g} rad is at the pole of its chart (pi/2), where an azimuth means nothing",
                      table_.where(i), row[1]));
    m.elevation = frame_.angle(row[1]);
  }

  SensorType type_;
  const Table& table_;
  Frame frame_;
  bool planar_;
};

std::vector<Measurement> measurements(SensorType type, const std::filesystem::path& file,
                                      const SensorSurroundings& around) {
  const bool may_repeat = type != SensorType::position && type != SensorType::pose;
  const Table table =
      read_csv(file, header(type, around.planar), may_repeat ? TimeOrder::repeating : TimeOrder::increasing);
  const RowReader reader(type, table, around);
  std::vector<Measurement> result;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    if (table.t(i) < around.first - kSameInstant || table.t(i) > around.last + kSameInstant)
      throw Error(fmt::format("{}: time {} lies outside {}, {} to {} s", table.where(i), table.t(i), around.span_of,
                              around.first, around.last));
    result.push_back(reader.read(i));
  }
  return result;
}

}  // namespace

SensorType sensor_type(const YamlSection& entry) {
  const std::string given = entry.text("type");
  std::vector<std::string> known;
  for (const SensorType type : {SensorType::position, SensorType::pose, SensorType::range_bearing, SensorType::bearing,
                                SensorType::range, SensorType::usbl_spherical}) {
    known.emplace_back(name(type));
    if (known.back() == given) return type;
  }
  const std::vector<std::string>& ego = ego_types();
  known.insert(known.end(), ego.begin(), ego.end());
  entry.fail("type", fmt::format("unknown sensor type {}{}", quote(given), did_you_mean(given, known)));
}

TargetSensor read_sensor(const std::string& name, const YamlSection& entry, const SensorSurroundings& around) {
  TargetSensor sensor;
  sensor.name = name;
  sensor.type = sensor_type(entry);
  const int n = rows(sensor.type, around.planar);
  if (n == 0) entry.fail("type", "sensor type usbl_spherical is not planar: use range_bearing with group SE2");
  std::vector<std::string> keys = {"type",  "file", "sigma", "position", "orientation", "target_position",
                                   "delay", "loss"};
  if (sensor.type == SensorType::pose) keys.insert(keys.end(), {"target_orientation", "orientation_loss"});
  entry.allow_only(keys);

  sensor.sigma.resize(n);
  read_sigmas(entry, "sigma", {sensor.sigma.data(), std::size_t(n)});
  sensor.mount = read_extrinsics(entry, around.frame);
  sensor.marker = read_extrinsics(entry, around.frame, "target_");
  sensor.delay = read_delay(entry);
  sensor.loss = read_loss(entry, "loss");
  sensor.orientation_loss = read_loss(entry, "orientation_loss");
  sensor.measurements = measurements(sensor.type, around.folder / entry.text("file"), around);
  return sensor;
}

TargetSensor read_undeclared_sensor(const std::string& name, SensorType type, const SensorSurroundings& around) {
  TargetSensor sensor;
  sensor.name = name;
  sensor.type = type;
  sensor.sigma = Eigen::VectorXd::Zero(rows(type, around.planar));
  sensor.measurements = measurements(type, around.folder / (name + ".csv"), around);
  return sensor;
}

}  // namespace tandem
