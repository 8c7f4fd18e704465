#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/lie/error.hpp>
#include <tandem/studies/export/exported_trajectory.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>
#include <tandem/studies/support/tum.hpp>

namespace tandem {
namespace {

namespace fs = std::filesystem;

/// Returns the numbers of a line, nan for empty or invalid cells.
std::vector<double> numbers(std::string_view line, char separator) {
  std::vector<double> values;
  for (const std::string_view cell : separator == ' ' ? words(line) : split(line, separator))
    values.push_back(parse_number(cell).value_or(std::nan("")));
  return values;
}

ExportedTrajectory read_tum_file(const fs::path& file) {
  ExportedTrajectory trajectory{file.stem().string(), {}};
  InputFile stream(file);
  int number = 0;
  bool oriented = true;  // the next row
  for (std::string line; std::getline(stream, line);) {
    ++number;
    if (trimmed(line) == tum_no_orientation) oriented = false;
    if (trimmed(line).empty() || trimmed(line).front() == '#') continue;
    const std::vector<double> v = numbers(line, ' ');
    if (v.size() != 8 || !std::isfinite(v[0] + v[1] + v[2] + v[3]))
      throw Error(fmt::format("{}:{}: expected t x y z qx qy qz qw", file.string(), number));
    ExportedPose pose{v[0], {v[1], v[2], v[3]}, {}};
    if (std::exchange(oriented, true) && std::isfinite(v[4] + v[5] + v[6] + v[7]))
      pose.orientation = {v[4], v[5], v[6], v[7]};
    trajectory.poses.push_back(std::move(pose));
  }
  return trajectory;
}

/// Adds velocities and covariances from NAME_full.csv, if it exists.
void add_full(const fs::path& file, ExportedTrajectory& trajectory) {
  if (!fs::exists(file)) return;
  InputFile stream(file);
  std::string line;
  std::getline(stream, line);
  const std::string header = line;
  const std::vector<std::string_view> columns = split(header, ',');
  const auto column = [&](const std::string& name) {
    return static_cast<std::size_t>(std::find(columns.begin(), columns.end(), name) - columns.begin());
  };
  for (ExportedPose& pose : trajectory.poses) {
    if (!std::getline(stream, line)) return;
    const std::vector<double> v = numbers(line, ',');
    const auto value = [&](const std::string& name) {
      const std::size_t at = column(name);
      return at < v.size() ? v[at] : std::nan("");
    };
    for (std::size_t i = 0; i < 3; ++i) {
      const std::string axis(1, "xyz"[i]);
      const double linear = value("v" + axis), angular = value("w" + axis);
      pose.velocity[i] = std::isfinite(linear) ? linear : 0;
      pose.angular_velocity[i] = std::isfinite(angular) ? angular : 0;
    }
    const std::size_t n = pose.orientation ? 6 : 3;
    std::vector<double> covariance;
    for (std::size_t i = 1; i <= n; ++i)
      for (std::size_t j = 1; j <= n; ++j) covariance.push_back(value(fmt::format("c{}{}", i, j)));
    if (std::all_of(covariance.begin(), covariance.end(), [](double c) { return std::isfinite(c); }))
      pose.covariance = std::move(covariance);
  }
}

/// Sets axes and origin from the run's summary and its scenario, or from the scenario itself.
void read_frame(const fs::path& folder, ExportedRun& run) {
  fs::path scenario = folder;
  if (!fs::exists(folder / "scenario.yaml")) {
    if (fs::exists(folder / "summary.json")) {
      const auto json = nlohmann::json::parse(read_text(folder / "summary.json"), nullptr, false);
      if (json.is_object()) run.ned = json.value("frame", "") == "NED-FRD";
    }
    if (!fs::exists(folder / "run.yaml")) return;
    const YamlSection settings = YamlSection::load(folder / "run.yaml");
    if (!settings.has("scenario")) return;
    scenario = settings.text("scenario");
    if (!fs::exists(scenario / "scenario.yaml")) scenario = builtin_scenarios() / scenario;
    if (!fs::exists(scenario / "scenario.yaml")) return;
  }
  const YamlSection yaml = YamlSection::load(scenario / "scenario.yaml");
  if (scenario == folder) run.ned = yaml.has("frame") && yaml.text("frame") == "NED-FRD";
  if (!yaml.has("origin")) return;
  const std::vector<double> origin = yaml.numbers("origin", 3);
  run.origin = GeographicPoint{origin[0], origin[1], origin[2]};
}

}  // namespace

ExportedRun read_exported_run(const fs::path& folder) {
  if (!fs::is_directory(folder)) throw Error(fmt::format("{} is not a folder", folder.string()));
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".tum") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  ExportedRun run;
  for (const fs::path& file : files) {
    ExportedTrajectory trajectory = read_tum_file(file);
    if (trajectory.poses.empty()) continue;  // a truth that covers none of the run
    add_full(folder / (file.stem().string() + "_full.csv"), trajectory);
    run.trajectories.push_back(std::move(trajectory));
  }
  if (run.trajectories.empty())
    throw Error(fmt::format(
        "{} has no trajectory with poses (*.tum); give the output folder of tandem estimate or navigate, or a "
        "scenario folder",
        folder.string()));
  read_frame(folder, run);
  return run;
}

}  // namespace tandem
