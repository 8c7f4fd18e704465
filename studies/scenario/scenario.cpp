#include <algorithm>
#include <cmath>
#include <tuple>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/scenario/scenario_ego.hpp>
#include <tandem/studies/scenario/scenario_sensors.hpp>
#include <tandem/studies/scenario/sensor_file.hpp>
#include <tandem/studies/scenario/sensor_rows.hpp>
#include <tandem/studies/scenario/table.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

std::vector<Stamped<SE3>> trajectory(const Scenario& scenario, const Table& table) {
  std::vector<Stamped<SE3>> result = poses(table);
  for (auto& [t, pose] : result) pose = inner_pose(pose, scenario.frame, scenario.data.planar);
  return result;
}

/// A true trajectory. Throws Error on what is no place: errors against it would be no numbers.
std::vector<Stamped<SE3>> true_trajectory(const Scenario& scenario, const Table& table) {
  constexpr double kFarthest = 1e12;  // m
  for (std::size_t i = 0; i < table.rows(); ++i)
    for (int axis = 1; axis <= 3; ++axis)
      if (const double x = table.row(i)[axis]; std::abs(x) > kFarthest)
        throw Error(fmt::format("{}: no truth is {:.3g} m away", table.where(i), x));
  return trajectory(scenario, table);
}

bool contains(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

class ScenarioReader {
 public:
  /// Without `rows_in`, all is read.
  ScenarioReader(const std::filesystem::path& folder, YamlSection yaml, std::optional<RowsIn> rows_in = {},
                 const Stop& stop = {})
      : folder_(folder), yaml_(std::move(yaml)), rows_in_(rows_in), stop_(stop) {}

  Scenario read() {
    scenario_.folder = folder_;
    read_head();
    read_ego_sensors();
    read_odometry();
    read_declared_sensors();
    read_undeclared_sensors();
    if (!scenario_.navigation || has_odometry() || !data_.sensors.empty() || yaml_.has("noise"))
      read_noise(yaml_.section("noise"));
    if (!scenario_.navigation &&
        std::all_of(data_.sensors.begin(), data_.sensors.end(),
                    [&](const TargetSensor& sensor) { return all_rows() && sensor.measurements.empty(); }))
      throw Error(fmt::format("{} has no measurements: neither usbl.csv, optical.csv nor another sensor gives any",
                              folder_.string()));
    if (all_rows()) read_truth(scenario_, stop_);
    return std::move(scenario_);
  }

 private:
  void read_head() {
    yaml_.allow_only({"name", "description", "source", "licence", "keyframe_interval", "noise", "sensors", "frame",
                      "group", "latitude", "gravity", "truth_orientation"});
    if (one_of("frame", {"ENU-FLU", "NED-FRD"}) == "NED-FRD") scenario_.frame = Frame::ned_frd();
    data_.planar = one_of("group", {"SE3", "SE2"}) == "SE2";
    data_.noise = TrackingNoise(data_.planar);
    scenario_.name = yaml_.has("name") ? yaml_.text("name") : std::filesystem::canonical(folder_).filename().string();
    if (yaml_.has("description")) scenario_.description = yaml_.text("description");
    if (yaml_.has("source")) scenario_.source = yaml_.text("source");
    if (yaml_.has("truth_orientation")) scenario_.truth_orientation = yaml_.boolean("truth_orientation");
    for (const char* key : {"latitude", "gravity"})  // they count where there are ego sensors, see read_earth
      if (yaml_.has(key)) yaml_.number(key);
    if (!yaml_.has("keyframe_interval")) return;
    data_.keyframe_interval = yaml_.number("keyframe_interval");
    if (data_.keyframe_interval <= kSameInstant)
      yaml_.fail("keyframe_interval", "keyframe_interval must be above 0.001 s");
  }

  /// The value of a key, the first of `known` where it is not given.
  std::string one_of(const std::string& key, const std::vector<std::string>& known) {
    if (!yaml_.has(key)) return known.front();
    const std::string given = yaml_.text(key);
    if (!contains(known, given))
      yaml_.fail(key, fmt::format("unknown {} {}{}", key, quote(given), did_you_mean(given, known)));
    return given;
  }

  void read_ego_sensors() {
    if (!yaml_.has("sensors")) return;
    const YamlSection sensors = yaml_.section("sensors");
    NavigationData navigation;
    for (const std::string& name : sensors.keys()) {
      const YamlSection entry = sensors.section(name);
      if (!is_ego_sensor(entry)) {
        if (!odometry_there()) sensor_type(entry);  // a misspelt type says more than that odometry is missing
        continue;
      }
      if (data_.planar)
        entry.fail("type", fmt::format("sensor type {} is not planar: leave out group SE2", entry.text("type")));
      read_ego_sensor(name, entry, folder_, scenario_.frame, navigation, all_rows(), stop_);
      const std::filesystem::path file = sensor_file(entry, folder_);
      if (entry.text("type") == "imu")
        scenario_.files.imu = file;
      else
        scenario_.files.ego.push_back(file);
      ego_.push_back(name);
      files_.push_back(std::filesystem::path(entry.text("file")).filename().string());
    }
    if (ego_.empty()) return;
    navigation.earth = read_earth(yaml_);
    navigation.keyframe_interval = data_.keyframe_interval;
    scenario_.navigation = std::move(navigation);
  }

  bool all_rows() const { return !rows_in_; }
  bool noise_names(const std::string& name) const {
    return rows_in_ == RowsIn::stream && yaml_.has("noise") && yaml_.section("noise").has(name);
  }
  bool odometry_there() const {
    return std::filesystem::exists(folder_ / "chaser_odometry.tum") || noise_names("odometry");
  }
  bool has_odometry() const { return scenario_.files.odometry.has_value(); }

  void read_odometry() {
    if (scenario_.navigation && !odometry_there()) return;
    const std::filesystem::path file = folder_ / "chaser_odometry.tum";
    scenario_.files.odometry = file;
    if (!all_rows()) return;
    const Table table = read_tum(file, stop_);
    if (table.rows() < 2) throw Error(fmt::format("{} needs two poses or more", table.file.string()));
    data_.odometry = trajectory(scenario_, table);
  }

  SensorSurroundings surroundings() const {
    SensorSurroundings around{folder_, scenario_.frame, data_.planar};
    around.rows = all_rows();
    around.stop = stop_;
    if (!around.rows) return around;
    if (has_odometry()) {
      around.first = data_.odometry.front().t;
      around.last = data_.odometry.back().t;
    } else if (const auto span = time_span(*scenario_.navigation)) {
      std::tie(around.first, around.last) = *span;
      around.span_of = "the span of the chaser's own sensors";
    }
    return around;
  }

  void read_declared_sensors() {
    if (!yaml_.has("sensors")) return;
    const YamlSection sensors = yaml_.section("sensors");
    declared_ = sensors.keys();
    for (const std::string& name : declared_) {
      if (contains(ego_, name)) continue;
      const YamlSection entry = sensors.section(name);
      data_.sensors.push_back(read_sensor(name, entry, surroundings()));
      scenario_.files.target.push_back(sensor_file(entry, folder_));
      if (!entry.has("position") && !entry.has("orientation")) scenario_.without_extrinsics.push_back(name);
      files_.push_back(std::filesystem::path(entry.text("file")).filename().string());
    }
  }

  void read_undeclared_sensors() {
    for (const auto& [name, type] : {std::pair{"usbl", SensorType::position}, {"optical", SensorType::pose}}) {
      const std::string file = std::string(name) + ".csv";
      if (contains(files_, file) || !(std::filesystem::exists(folder_ / file) || noise_names(name))) continue;
      if (contains(declared_, name))
        yaml_.section("sensors").fail(name,
                                      fmt::format("sensor {0} must read {0}.csv, which is there, or be renamed", name));
      data_.sensors.push_back(read_undeclared_sensor(name, type, surroundings()));
      scenario_.files.target.push_back(folder_ / file);
      undeclared_.push_back(name);
    }
  }

  void read_noise(const YamlSection& noise) {
    std::vector<double> unread(6);  // checked all the same, so that a folder serves every sensor set
    std::vector<NamedNoise> known = named_noise(data_);
    std::erase_if(known, [&](const NamedNoise& entry) { return contains(declared_, entry.name); });
    for (NamedNoise& entry : known) {
      if (entry.name == "prior" || entry.name == "odometry") entry.required = has_odometry();
      if (entry.name == "constant_twist") entry.required = !scenario_.navigation || !data_.sensors.empty();
      entry.required |= contains(undeclared_, entry.name);
    }
    for (const auto& [name, type] : {std::pair{"usbl", SensorType::position}, {"optical", SensorType::pose}})
      if (!contains(undeclared_, name))
        known.push_back({name, std::span(unread).first(static_cast<std::size_t>(rows(type, data_.planar)))});

    std::vector<std::string> names;
    for (const NamedNoise& entry : known) names.push_back(entry.name);
    noise.allow_only(names);
    for (const NamedNoise& entry : known)
      if (entry.required || noise.has(entry.name)) read_sigmas(noise, entry.name, entry.sigmas);
    turn_noise(data_.noise, scenario_.frame);
  }

  std::filesystem::path folder_;
  YamlSection yaml_;
  std::optional<RowsIn> rows_in_;
  Stop stop_;
  Scenario scenario_;
  TrackingData& data_ = scenario_.data;
  std::vector<std::string> declared_, undeclared_, ego_;  ///< sensors' names
  std::vector<std::string> files_;                        ///< that the declared ones read
};

}  // namespace

Scenario read_scenario(const std::filesystem::path& folder, const Stop& stop) {
  return ScenarioReader(folder, YamlSection::load(folder / "scenario.yaml"), {}, stop).read();
}

Scenario read_settings(const std::filesystem::path& folder, RowsIn rows) {
  return ScenarioReader(folder, YamlSection::load(folder / "scenario.yaml"), rows).read();
}

Scenario read_settings(const std::string& yaml, const std::filesystem::path& folder, RowsIn rows) {
  return ScenarioReader(folder, YamlSection::parse(yaml, folder / "scenario.yaml"), rows).read();
}

void read_truth(Scenario& scenario, const Stop& stop) {
  const std::filesystem::path chaser = scenario.folder / "truth_chaser.tum",
                              target = scenario.folder / "truth_target.tum";
  if (std::filesystem::exists(chaser)) scenario.truth_chaser = true_trajectory(scenario, read_tum(chaser, stop));
  if (std::filesystem::exists(target)) scenario.truth_target = true_trajectory(scenario, read_tum(target, stop));
}

}  // namespace tandem
