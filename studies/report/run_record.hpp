#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace tandem {

/// Output folder of a run, as columns for figures and tables. Times are in seconds since the start of the chaser's
/// trajectory; positions are in the axes of the files. Long columns are thinned.
struct RunRecord {
  nlohmann::ordered_json summary;  ///< summary.json
  bool is_ned = false;             ///< the axes are north, east, down and forward, right, down
  double start = 0;                ///< stamp of the start [s]

  struct Path {
    std::vector<double> t, x, y, z;  ///< s, m
  };
  Path chaser, target, chaser_truth, target_truth, fixes;
  std::vector<std::string> fix_sensors;  ///< sensor of each fix

  /// A quantity over time, or the measurements of a sensor that show it.
  struct Curve {
    std::string name;
    std::vector<double> t, value;
  };
  std::vector<Curve> range, bearing;                  ///< of the target from the chaser, then of the fixes [m, deg]
  std::vector<Curve> position_sigma, rotation_sigma;  ///< standard deviations [m, deg]; NaN where unknown

  std::vector<double> t;               ///< times of errors
  std::vector<std::string> types;      ///< keyframe types
  std::vector<double> position_error;  ///< m; NaN without truth
  std::vector<double> error[4];        ///< estimate minus truth: x, y, z [m] along the chaser's axes, without a target
                                       ///< the world's, and about z [deg]
  std::vector<double> three_sigma[4];  ///< bounds of these errors

  /// Standardised residuals, or innovations of `tandem track`, with one outcome.
  struct Residuals {
    std::string sensor, component;
    std::string outcome;           ///< used, down-weighted, rejected or held-out
    std::vector<double> t, value;  ///< value: in expected standard deviations; NaN if there is none
  };
  std::vector<Residuals> residuals;

  bool has_target() const { return !target.t.empty(); }
  bool has_truth() const;
  double duration() const { return chaser.t.empty() ? 0 : chaser.t.back(); }
  /// Returns whether these are innovations of `tandem track` instead of residuals.
  bool is_online() const { return summary.contains("updates"); }
};

/// Returns the different words of a list, in the order of their first occurrence.
std::vector<std::string> different(const std::vector<std::string>& words);

/// Returns whether the folder looks like an output folder of `tandem estimate`, `navigate` or `track`.
bool is_run(const std::filesystem::path& folder);
/// Reads an output folder. Throws Error that names the file if one is missing or malformed.
RunRecord read_run(const std::filesystem::path& folder);

}  // namespace tandem
