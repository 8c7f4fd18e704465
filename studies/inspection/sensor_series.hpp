#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace tandem {

/// The rows of one sensor of a scenario, as its file has them: t [s] first, then the columns of its type.
struct SensorSeries {
  std::string name;
  std::string type;  ///< as in scenario.yaml, or odometry, truth_chaser and truth_target
  std::size_t rows = 0;
  std::vector<std::string> columns{};
  std::function<double(std::size_t row, std::size_t column)> at;
  bool turned = false;  ///< whether the sensor has an orientation in the body, so that its angles are not in body axes

  double t(std::size_t row) const { return at(row, 0); }
};

/// Gaps of a series: intervals without rows that are far longer than the median one.
struct SeriesGaps {
  double median_step = 0;  ///< s
  std::size_t count = 0;
  double longest = 0, longest_from = 0;  ///< s
};
SeriesGaps gaps_of(const SensorSeries& series);

/// Returns one sentence for everything that looks wrong: units, signs, gaps, clocks, and elevations whose sign
/// contradicts the depth. `ned`: the axes of the scenario are NED-FRD.
std::vector<std::string> series_findings(const std::vector<SensorSeries>& all, bool ned);

/// Returns a time as UTC if it is since 1970, otherwise in seconds.
std::string time_text_of(double t);

}  // namespace tandem
