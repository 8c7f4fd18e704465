#include <algorithm>
#include <cmath>
#include <tuple>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/measurement_screen.hpp>
#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/scenario/scenario_ego.hpp>
#include <tandem/studies/scenario/scenario_sensors.hpp>
#include <tandem/studies/scenario/sensor_file.hpp>
#include <tandem/studies/scenario/sensor_rows.hpp>
#include <tandem/studies/scenario/table.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

std::vector<Stamped<SE3>> trajectory(const Scenario& scenario, const Table& table) {
  std::vector<Stamped<SE3>> result = poses(table);
  for (auto& [t, pose] : result) pose = internal_pose(pose, scenario.frame, scenario.data.planar);
  return result;
}

/// Removes the rows that stand for missing poses, and reports them.
Table without_missing_poses(const Table& table, std::vector<NavigationFinding>& findings) {
  Table kept{table.file, table.columns, {}, {}};
  NavigationFinding missing{NavigationFinding::Kind::not_finite, "odometry"};
  for (std::size_t i = 0; i < table.rows(); ++i) {
    if (is_missing_pose(table.row(i))) {
      if (missing.count++ == 0) missing.from = table.t(i);
      missing.to = table.t(i);
      continue;
    }
    kept.values.insert(kept.values.end(), table.row(i), table.row(i) + table.columns);
    kept.lines.push_back(table.lines[i]);
  }
  if (missing.count > 0) findings.push_back(missing);
  return kept;
}

/// Returns a true trajectory. Throws Error on coordinates so large that error statistics would overflow.
std::vector<Stamped<SE3>> true_trajectory(const Scenario& scenario, const Table& table) {
  constexpr double kMaxCoordinate = 1e12;  // m
  for (std::size_t i = 0; i < table.rows(); ++i)
    for (int axis = 1; axis <= 3; ++axis)
      if (const double x = table.row(i)[axis]; std::abs(x) > kMaxCoordinate)
        throw Error(fmt::format("{}: the true position {:.3g} m is not plausible; the limit is {:g} m", table.where(i),
                                x, kMaxCoordinate));
  return trajectory(scenario, table);
}

bool contains(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

class ScenarioReader {
 public:
  /// Also reads the rows of the sensor files, unless `rows_in` is given.
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
    if (all_rows())
      for (NavigationFinding& finding : screen(data_)) scenario_.findings.push_back(std::move(finding));
    if (!scenario_.navigation &&
        std::all_of(data_.sensors.begin(), data_.sensors.end(),
                    [&](const TargetSensor& sensor) { return all_rows() && sensor.measurements.empty(); }))
      throw Error(fmt::format(
          "{} has no measurements of a target; give usbl.csv, optical.csv or another sensor with at least one row",
          folder_.string()));
    if (all_rows()) read_truth(scenario_, stop_);
    return std::move(scenario_);
  }

 private:
  void read_head() {
    yaml_.allow_only({"name", "description", "source", "licence", "keyframe_interval", "noise", "sensors", "frame",
                      "group", "latitude", "gravity", "truth_orientation", "origin"});
    if (one_of("frame", {"ENU-FLU", "NED-FRD"}) == "NED-FRD") scenario_.frame = Frame::ned_frd();
    data_.planar = one_of("group", {"SE3", "SE2"}) == "SE2";
    data_.noise = TrackingNoise(data_.planar);
    scenario_.name = yaml_.has("name") ? yaml_.text("name") : std::filesystem::canonical(folder_).filename().string();
    if (yaml_.has("description")) scenario_.description = yaml_.text("description");
    if (yaml_.has("source")) scenario_.source = yaml_.text("source");
    if (yaml_.has("truth_orientation")) scenario_.truth_orientation = yaml_.boolean("truth_orientation");
    if (yaml_.has("origin")) yaml_.numbers("origin", 3);  // scenario_origin.hpp reads it
    read_earth(yaml_);                                    // checks latitude and gravity, also without own sensors
    if (!yaml_.has("keyframe_interval")) return;
    data_.keyframe_interval = yaml_.number("keyframe_interval");
    if (data_.keyframe_interval <= kSameInstant)
      yaml_.fail("keyframe_interval", "keyframe_interval must be above 0.001 s");
  }

  /// Returns the value of a key, which must be one of `known`. The default is the first of them.
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
        if (!odometry_exists()) sensor_type(entry);  // reports a misspelt type rather than missing odometry
        continue;
      }
      if (data_.planar)
        entry.fail("type",
                   fmt::format("sensor type {} is not supported with group SE2; use group SE3", entry.text("type")));
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
  bool noise_has_entry(const std::string& name) const {
    return rows_in_ == RowsIn::stream && yaml_.has("noise") && yaml_.section("noise").has(name);
  }
  bool odometry_exists() const {
    return std::filesystem::exists(folder_ / "chaser_odometry.tum") || noise_has_entry("odometry");
  }
  bool has_odometry() const { return scenario_.files.odometry.has_value(); }

  void read_odometry() {
    if (scenario_.navigation && !odometry_exists()) return;
    const std::filesystem::path file = file_in(folder_, "chaser_odometry.tum");
    scenario_.files.odometry = file;
    if (!all_rows()) return;
    const Table table = without_missing_poses(tandem::read_odometry(file, stop_), scenario_.findings);
    if (table.rows() < 2) throw Error(fmt::format("{} must have at least two poses", table.file.string()));
    data_.odometry = trajectory(scenario_, table);
  }

  SensorContext sensor_context() const {
    SensorContext context{folder_, scenario_.frame, data_.planar};
    context.rows = all_rows();
    context.stop = stop_;
    if (!context.rows) return context;
    if (has_odometry()) {
      context.first = data_.odometry.front().t;
      context.last = data_.odometry.back().t;
    } else if (const auto span = time_span(*scenario_.navigation)) {
      std::tie(context.first, context.last) = *span;
      context.span_of = "the chaser's own sensors";
    }
    return context;
  }

  void read_declared_sensors() {
    if (!yaml_.has("sensors")) return;
    const YamlSection sensors = yaml_.section("sensors");
    declared_ = sensors.keys();
    for (const std::string& name : declared_) {
      if (contains(ego_, name)) continue;
      const YamlSection entry = sensors.section(name);
      data_.sensors.push_back(read_sensor(name, entry, sensor_context()));
      scenario_.files.target.push_back(sensor_file(entry, folder_));
      if (!entry.has("position") && !entry.has("orientation")) scenario_.without_extrinsics.push_back(name);
      files_.push_back(std::filesystem::path(entry.text("file")).filename().string());
    }
  }

  void read_undeclared_sensors() {
    for (const auto& [name, type] : {std::pair{"usbl", SensorType::position}, {"optical", SensorType::pose}}) {
      const std::string file = std::string(name) + ".csv";
      if (contains(files_, file) || !(std::filesystem::exists(folder_ / file) || noise_has_entry(name))) continue;
      if (contains(declared_, name))
        yaml_.section("sensors").fail(
            name,
            fmt::format("sensor {0} must read {0}.csv, since that file exists; set its file, or rename it", name));
      data_.sensors.push_back(read_undeclared_sensor(name, type, sensor_context()));
      scenario_.files.target.push_back(file_in(folder_, file));
      undeclared_.push_back(name);
    }
  }

  void read_noise(const YamlSection& noise) {
    std::vector<double> unread(6);  // noise of absent sensors is checked but not used
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
    convert_noise_axes(data_.noise, scenario_.frame);
  }

  std::filesystem::path folder_;
  YamlSection yaml_;
  std::optional<RowsIn> rows_in_;
  Stop stop_;
  Scenario scenario_;
  TrackingData& data_ = scenario_.data;
  std::vector<std::string> declared_, undeclared_, ego_;  ///< sensor names
  std::vector<std::string> files_;                        ///< file names of the declared sensors
};

}  // namespace

Scenario read_scenario(const std::filesystem::path& folder, const Stop& stop) {
  return ScenarioReader(folder, YamlSection::load(file_in(folder, "scenario.yaml")), {}, stop).read();
}

Scenario read_settings(const std::filesystem::path& folder, RowsIn rows) {
  return ScenarioReader(folder, YamlSection::load(file_in(folder, "scenario.yaml")), rows).read();
}

Scenario read_settings(const std::string& yaml, const std::filesystem::path& folder, RowsIn rows) {
  return ScenarioReader(folder, YamlSection::parse(yaml, folder / "scenario.yaml"), rows).read();
}

void read_truth(Scenario& scenario, const Stop& stop) {
  for (const auto& [name, truth] :
       {std::pair{"truth_chaser.tum", &scenario.truth_chaser}, {"truth_target.tum", &scenario.truth_target}})
    if (std::filesystem::exists(scenario.folder / name))
      *truth = true_trajectory(scenario, read_tum(file_in(scenario.folder, name), stop));
}

}  // namespace tandem
