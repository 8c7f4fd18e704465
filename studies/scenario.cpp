#include <algorithm>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/named_noise.hpp>
#include <tandem/studies/quaternion.hpp>
#include <tandem/studies/scenario.hpp>
#include <tandem/studies/table.hpp>
#include <tandem/studies/text.hpp>
#include <tandem/studies/yaml_section.hpp>

namespace tandem {
namespace {

constexpr double kSameInstant = 1e-3;  // s: times this close are one

bool contains(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

template <class Sensor>
bool measure_nothing(const std::vector<Sensor>& sensors) {
  return std::all_of(sensors.begin(), sensors.end(), [](const Sensor& sensor) { return sensor.measurements.empty(); });
}

class ScenarioReader {
 public:
  explicit ScenarioReader(const std::filesystem::path& folder)
      : folder_(folder), yaml_(YamlSection::load(folder / "scenario.yaml")) {}

  Scenario read() {
    scenario_.folder = folder_;
    read_head();
    read_odometry();
    read_declared_sensors();
    read_undeclared_sensors();
    read_noise(yaml_.section("noise"));
    if (measure_nothing(data_.position_sensors) && measure_nothing(data_.pose_sensors))
      throw Error(fmt::format("{} has no measurements: neither usbl.csv, optical.csv nor another sensor gives any",
                              folder_.string()));
    read_truth();
    return std::move(scenario_);
  }

 private:
  void read_head() {
    yaml_.allow_only({"name", "description", "source", "licence", "keyframe_interval", "noise", "sensors", "frame",
                      "group", "latitude", "gravity", "truth_orientation"});
    supported("frame", "ENU-FLU", {"NED-FRD"});
    supported("group", "SE3", {"SE2"});
    scenario_.name = yaml_.has("name") ? yaml_.text("name") : std::filesystem::canonical(folder_).filename().string();
    if (yaml_.has("description")) scenario_.description = yaml_.text("description");
    if (yaml_.has("source")) scenario_.source = yaml_.text("source");
    if (yaml_.has("truth_orientation")) scenario_.truth_orientation = yaml_.boolean("truth_orientation");
    for (const char* key : {"latitude", "gravity"})  // for inertial sensors, which are refused below
      if (yaml_.has(key)) yaml_.number(key);
    if (yaml_.has("sensors")) check_sensors(yaml_.section("sensors"));
    if (!yaml_.has("keyframe_interval")) return;
    data_.keyframe_interval = yaml_.number("keyframe_interval");
    if (data_.keyframe_interval <= kSameInstant)
      yaml_.fail("keyframe_interval", "keyframe_interval must be above 0.001 s");
  }

  /// Of the values that the format knows for a key, this version reads one.
  void supported(const std::string& key, const std::string& value, const std::vector<std::string>& others) {
    if (!yaml_.has(key) || yaml_.text(key) == value) return;
    const std::string given = yaml_.text(key);
    if (contains(others, given))
      yaml_.fail(key, fmt::format("{} {} is not supported by this version ({} is)", key, given, value));
    std::vector<std::string> known = others;
    known.push_back(value);
    yaml_.fail(key, fmt::format("unknown {} {}{}", key, quote(given), did_you_mean(given, known)));
  }

  void read_odometry() {
    const Table table = read_tum(folder_ / "chaser_odometry.tum");
    if (table.rows() < 2) throw Error(fmt::format("{} needs two poses or more", table.file.string()));
    data_.odometry = poses(table);
  }

  static void check_sensors(const YamlSection& sensors) {
    static const std::vector<std::string> unsupported = {"range_bearing", "bearing", "range", "usbl_spherical", "imu",
                                                         "dvl",           "depth",   "gps",   "heading"};
    for (const std::string& name : sensors.keys()) {
      const YamlSection sensor = sensors.section(name);
      const std::string type = sensor.text("type");
      std::vector<std::string> keys = {"type", "file", "sigma", "position", "orientation", "target_position"};
      if (contains(unsupported, type))
        sensor.fail("type",
                    fmt::format("sensor type {} is not supported by this version (position and pose are)", type));
      if (type == "pose")
        keys.push_back("target_orientation");
      else if (type != "position")
        sensor.fail("type",
                    fmt::format("unknown sensor type {}{}", quote(type), did_you_mean(type, {"position", "pose"})));
      if (sensor.has("delay")) sensor.fail("delay", "delay is not supported by this version");
      sensor.allow_only(keys);
    }
  }

  void read_declared_sensors() {
    if (!yaml_.has("sensors")) return;
    const YamlSection sensors = yaml_.section("sensors");
    declared_ = sensors.keys();
    for (const std::string& name : declared_) {
      const YamlSection entry = sensors.section(name);
      const std::filesystem::path file = folder_ / entry.text("file");
      const SE3 mount = extrinsics(entry, "position", "orientation");
      const SE3 marker = extrinsics(entry, "target_position", "target_orientation");
      if (entry.text("type") == "pose") {
        PoseSensor& sensor = add_pose_sensor(name, file);
        sensor.mount = mount;
        sensor.marker = marker;
        read_sigmas(entry, "sigma", {sensor.sigma.data(), 6});
      } else {
        PositionSensor& sensor = add_position_sensor(name, file);
        sensor.mount = mount;
        sensor.beacon = marker.translation();
        read_sigmas(entry, "sigma", {sensor.sigma.data(), 3});
      }
      files_.push_back(file.filename().string());
    }
  }

  void read_undeclared_sensors() {
    for (const std::string name : {"usbl", "optical"}) {
      const std::filesystem::path file = folder_ / (name + ".csv");
      if (!std::filesystem::exists(file) || contains(files_, file.filename().string())) continue;
      if (contains(declared_, name))
        yaml_.section("sensors").fail(name,
                                      fmt::format("sensor {0} must read {0}.csv, which is there, or be renamed", name));
      name == "usbl" ? void(add_position_sensor(name, file)) : void(add_pose_sensor(name, file));
      undeclared_.push_back(name);
    }
  }

  PositionSensor& add_position_sensor(const std::string& name, const std::filesystem::path& file) {
    PositionSensor& sensor = data_.position_sensors.emplace_back();
    sensor.name = name;
    sensor.measurements = positions(within_odometry(read_csv(file, "t,x,y,z")));
    return sensor;
  }

  PoseSensor& add_pose_sensor(const std::string& name, const std::filesystem::path& file) {
    PoseSensor& sensor = data_.pose_sensors.emplace_back();
    sensor.name = name;
    sensor.measurements = poses(within_odometry(read_csv(file, "t,x,y,z,qx,qy,qz,qw")));
    return sensor;
  }

  Table within_odometry(Table table) const {
    const double first = data_.odometry.front().t, last = data_.odometry.back().t;
    for (std::size_t i = 0; i < table.rows(); ++i)
      if (table.t(i) < first - kSameInstant || table.t(i) > last + kSameInstant)
        throw Error(fmt::format("{}: time {} lies outside the odometry's span, {} to {} s", table.where(i), table.t(i),
                                first, last));
    return table;
  }

  static SE3 extrinsics(const YamlSection& sensor, const std::string& position, const std::string& orientation) {
    Vector<3> t = Vector<3>::Zero();
    SO3 R;
    if (sensor.has(position)) t = Vector<3>(sensor.numbers(position, 3).data());
    if (sensor.has(orientation)) {
      const std::vector<double> xyzw = sensor.numbers(orientation, 4);
      const auto rotation = rotation_from(xyzw.data());
      if (!rotation) sensor.fail(orientation, not_a_rotation(xyzw.data()));
      R = *rotation;
    }
    return SE3(R, t);
  }

  void read_noise(const YamlSection& noise) {
    std::vector<double> unread(6);  // checked all the same, so that a folder serves every mode and sensor set
    std::vector<NamedNoise> known = named_noise(data_);
    std::erase_if(known, [&](const NamedNoise& entry) { return contains(declared_, entry.name); });
    for (NamedNoise& entry : known) entry.required |= contains(undeclared_, entry.name);
    for (const auto& [name, size] : {std::pair{"usbl", 3}, {"optical", 6}, {"constant_velocity", 3}, {"boundary", 3}})
      if (!contains(undeclared_, name))
        known.push_back({name, std::span(unread).first(static_cast<std::size_t>(size))});

    std::vector<std::string> names;
    for (const NamedNoise& entry : known) names.push_back(entry.name);
    noise.allow_only(names);
    for (const NamedNoise& entry : known)
      if (entry.required || noise.has(entry.name)) read_sigmas(noise, entry.name, entry.sigmas);
  }

  static void read_sigmas(const YamlSection& section, const std::string& key, std::span<double> sigmas) {
    const std::vector<double> values = section.numbers(key);
    const std::string reason = why_not_sigmas(values, sigmas.size());
    if (!reason.empty()) section.fail(key, fmt::format("{} {}", key, reason));
    std::copy(values.begin(), values.end(), sigmas.begin());
  }

  void read_truth() {
    const std::filesystem::path chaser = folder_ / "truth_chaser.tum", target = folder_ / "truth_target.tum";
    if (std::filesystem::exists(chaser)) scenario_.truth_chaser = poses(read_tum(chaser));
    if (std::filesystem::exists(target)) scenario_.truth_target = poses(read_tum(target));
  }

  std::filesystem::path folder_;
  YamlSection yaml_;
  Scenario scenario_;
  TrackingData& data_ = scenario_.data;
  std::vector<std::string> declared_, files_,
      undeclared_;  ///< sensors' names; files that the declared ones read
};

}  // namespace

Scenario read_scenario(const std::filesystem::path& folder) { return ScenarioReader(folder).read(); }

}  // namespace tandem
