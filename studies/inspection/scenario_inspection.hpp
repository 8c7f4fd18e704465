#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <tandem/studies/inspection/sensor_series.hpp>
#include <tandem/studies/scenario/table.hpp>
#include <tandem/studies/support/file_description.hpp>

namespace tandem {

/// The rows of all sensors of a scenario folder, read from its files without building a problem, so that a folder with
/// defects can be inspected, too.
struct ScenarioInspection {
  std::filesystem::path folder;
  std::string name, frame;
  std::vector<double> origin;  ///< latitude, longitude [deg] and height [m]; empty if the scenario has none
  std::vector<Table> tables;   ///< owners of the rows of `series`
  std::vector<SensorSeries> series;
  std::vector<std::string> unreadable;  ///< one sentence for each file that cannot be read
  std::vector<std::string> findings;    ///< suspicious data, one sentence each

  bool is_ned() const { return frame == "NED-FRD"; }
  double first() const, last() const;  ///< time of the first and last row of all sensors [s]
};

/// Inspects a scenario folder. Throws Error if its scenario.yaml cannot be read.
ScenarioInspection inspect_scenario(const std::filesystem::path& folder);

/// Returns a strip of `width` characters over the whole time: full blocks where the rate is at least the median, lower
/// blocks where it is less, and dots without rows.
std::string strip(const ScenarioInspection& scenario, const SensorSeries& series, std::size_t width);

double rate_of(const SensorSeries& series);  ///< mean rate [Hz]
/// Returns the smallest and the largest value of each column.
std::string range_text(const SensorSeries& series);
/// Returns the axes, the origin and the time span on one line.
std::string summary_text(const ScenarioInspection& scenario);

std::string inspection_text(const ScenarioInspection& scenario);
std::string inspection_json(const ScenarioInspection& scenario);
FileDescription inspection_json_keys();
/// Returns a self-contained page with strips, ranges and a plan view in the scenario's own axes: north up.
std::string inspection_page(const ScenarioInspection& scenario);

}  // namespace tandem
