#pragma once

#include <filesystem>
#include <map>
#include <sstream>
#include <string>

#include "paths.hpp"
#include "run_tandem.hpp"
#include "studies/scratch.hpp"

namespace tandem {

/// Returns the folder of the built-in scenario docking_a.
inline std::filesystem::path docking() { return std::filesystem::path(paths::source) / "share/scenarios/docking_a"; }

/// Returns the rows of docking_a until a time [s] as lines for --stdin, in time order. Lines with equal times are in
/// the order odometry, optical, usbl.
inline std::string docking_lines(double until) {
  std::multimap<std::pair<double, int>, std::string> lines;
  int rank = 0;
  for (const auto& [name, file] :
       {std::pair{"odometry", "chaser_odometry.tum"}, {"optical", "optical.csv"}, {"usbl", "usbl.csv"}}) {
    std::istringstream rows(read_file(docking() / file));
    for (std::string row; std::getline(rows, row);) {
      if (row.starts_with("#") || row.starts_with("t,")) continue;
      for (char& c : row)
        if (c == ' ') c = ',';
      const double t = std::stod(row);
      if (t <= until) lines.emplace(std::pair{t, rank}, std::string(name) + "," + row);
    }
    ++rank;
  }
  std::string text;
  for (const auto& [key, line] : lines) text += line + "\n";
  return text;
}

/// Runs `track --stdin` with these lines and the settings of docking_a.
inline Outcome track_lines(const std::string& lines, std::vector<std::string> options) {
  const ScratchFolder scratch;
  scratch.write("scenario.yaml", read_file(docking() / "scenario.yaml"));
  options.insert(options.begin(), {"track", scratch.path().string(), "--stdin"});
  return run_tandem(options, scratch.write("lines", lines));
}

}  // namespace tandem
