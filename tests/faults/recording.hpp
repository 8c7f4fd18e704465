#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <tandem/studies/scenario/scenario.hpp>

namespace tandem::faults {

/// A line of a live feed: "NAME,t,CELL,CELL…".
struct Line {
  double t;  ///< s
  std::string name;
  std::vector<std::string> cells;
  std::string raw{};  ///< in place of all that, where it is not empty

  std::string text() const;
};

/// A recording's files as one feed in time order, of one instant motion first.
struct Recording {
  Scenario settings;  ///< with its truth
  std::vector<Line> lines;
  std::string motion;                ///< the stream that the chaser moves by
  std::vector<std::string> sensors;  ///< the others

  /// Up to `until` s after the first line.
  Recording(const std::filesystem::path& folder, double until);

  std::string text() const;
};

}  // namespace tandem::faults
