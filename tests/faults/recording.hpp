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
  std::string raw{};  ///< if not empty, the whole line instead of the other members

  std::string text() const;
};

/// The files of a recording as one feed in time order; lines of the motion come first at equal times.
struct Recording {
  Scenario settings;  ///< with truth
  std::vector<Line> lines;
  std::string motion;                ///< stream of the chaser's motion
  std::vector<std::string> sensors;  ///< the other streams

  /// Reads the first `until` seconds of a folder.
  Recording(const std::filesystem::path& folder, double until);

  std::string text() const;
};

}  // namespace tandem::faults
