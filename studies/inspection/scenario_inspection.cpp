#include <algorithm>
#include <cmath>
#include <fstream>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/inspection/scenario_inspection.hpp>
#include <tandem/studies/scenario/sensor_file.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// A file of a scenario.
struct SeriesFile {
  std::string name, type;
  std::filesystem::path file;
  bool turned = false;  ///< has an orientation in the body
};

std::vector<SeriesFile> files_of(const YamlSection& yaml, const std::filesystem::path& folder,
                                 std::vector<std::string>& unreadable) {
  std::vector<SeriesFile> files;
  const auto add = [&](const std::string& name, const std::string& type, const std::string& file) {
    if (std::filesystem::exists(folder / file)) files.push_back({name, type, folder / file, false});
  };
  add("odometry", "odometry", "chaser_odometry.tum");
  std::vector<std::string> declared;
  if (yaml.has("sensors")) {
    const YamlSection sensors = yaml.section("sensors");
    for (const std::string& name : sensors.keys()) {
      const YamlSection sensor = sensors.section(name);
      declared.push_back(sensor.text("file"));
      try {
        files.push_back({name, sensor.text("type"), sensor_file(sensor, folder), sensor.has("orientation")});
      } catch (const Error& error) {  // outside the folder
        unreadable.emplace_back(error.what());
      }
    }
  }
  for (const auto& [name, type] : {std::pair{"usbl", "position"}, {"optical", "pose"}})
    if (std::find(declared.begin(), declared.end(), std::string(name) + ".csv") == declared.end())
      add(name, type, std::string(name) + ".csv");
  add("truth_chaser", "truth_chaser", "truth_chaser.tum");
  add("truth_target", "truth_target", "truth_target.tum");
  return files;
}

/// Reads a file with the columns that its first line names.
Table read(const SeriesFile& file, std::vector<std::string>& columns) {
  if (file.file.extension() == ".tum") {
    for (const char* column : {"t", "x", "y", "z", "qx", "qy", "qz", "qw"}) columns.emplace_back(column);
    RowFile rows(file.file, RowFormat::tum(), TimeOrder::any);
    return read_table(rows);
  }
  const std::string text = [&] {
    InputFile stream(file.file);
    for (std::string line; std::getline(stream, line);)
      if (const auto content = trimmed(line); !content.empty() && content.front() != '#') return std::string(content);
    throw Error(fmt::format("{} has no header", file.file.string()));
  }();
  for (const std::string_view column : split(text, ',')) columns.emplace_back(column);
  RowFile rows(file.file, RowFormat::csv(text), TimeOrder::any);
  return read_table(rows);
}

}  // namespace

double ScenarioInspection::first() const {
  double t = HUGE_VAL;
  for (const SensorSeries& s : series)
    if (s.rows > 0) t = std::min(t, s.t(0));
  return t;
}

double ScenarioInspection::last() const {
  double t = -HUGE_VAL;
  for (const SensorSeries& s : series)
    if (s.rows > 0) t = std::max(t, s.t(s.rows - 1));
  return t;
}

ScenarioInspection inspect_scenario(const std::filesystem::path& folder) {
  const YamlSection yaml = YamlSection::load(folder / "scenario.yaml");
  ScenarioInspection result;
  result.folder = folder;
  result.name = yaml.has("name") ? yaml.text("name") : folder.filename().string();
  result.frame = yaml.has("frame") ? yaml.text("frame") : "ENU-FLU";
  if (yaml.has("origin")) result.origin = yaml.numbers("origin", 3);
  const std::vector<SeriesFile> files = files_of(yaml, folder, result.unreadable);
  result.tables.reserve(files.size());  // the series refer to its elements
  for (const SeriesFile& file : files) try {
      std::vector<std::string> columns;
      result.tables.push_back(read(file, columns));
      const Table* table = &result.tables.back();
      result.series.push_back({file.name, file.type, table->rows(), std::move(columns),
                               [table](std::size_t row, std::size_t column) { return table->row(row)[column]; },
                               file.turned});
    } catch (const Error& error) {
      result.unreadable.emplace_back(error.what());
    }
  result.findings = series_findings(result.series, result.is_ned());
  return result;
}

std::string strip(const ScenarioInspection& scenario, const SensorSeries& series, std::size_t width) {
  constexpr const char* kLevels[] = {"·", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  const double first = scenario.first(), span = scenario.last() - first;
  std::vector<std::size_t> counts(width);
  for (std::size_t i = 0; i < series.rows; ++i) {
    const double place = span > 0 ? (series.t(i) - first) / span : 0;
    ++counts[std::min(width - 1, static_cast<std::size_t>(std::max(0.0, place) * static_cast<double>(width)))];
  }
  std::vector<std::size_t> sorted;
  for (const std::size_t n : counts)
    if (n > 0) sorted.push_back(n);
  if (sorted.empty()) return "";
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<long>(sorted.size() / 2), sorted.end());
  const double usual = static_cast<double>(sorted[sorted.size() / 2]);
  std::string text;
  for (const std::size_t n : counts) {
    const double share = static_cast<double>(n) / usual;
    text += kLevels[n == 0 ? 0 : std::clamp<std::size_t>(static_cast<std::size_t>(std::ceil(share * 8)), 1, 8)];
  }
  return text;
}

}  // namespace tandem
