#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tandem {

/// Trajectories and errors from the output folder of a run, as columns. Times are relative to the start of the chaser's
/// trajectory [s].
struct RunRecord {
  std::string scenario, model, solver, status;
  struct Path {
    std::vector<double> t, x, y, z;  ///< s, m
  };
  Path chaser, target, chaser_truth, target_truth, fixes;
  std::vector<std::string> fix_sensors;                   ///< sensor of each fix
  std::vector<double> t;                                  ///< times of errors
  std::vector<std::string> types;                         ///< keyframe types
  std::vector<double> position_error, orientation_error;  ///< m, deg; NaN without truth
  std::vector<double> error[3], three_sigma[3];           ///< m, along the chaser's axes; without a target the world's
  std::vector<std::vector<std::string>> table;            ///< errors by keyframe type, from summary.json
  struct Innovations {                                    ///< innovations of one sensor of `tandem track`
    std::string sensor;
    std::vector<double> t, sigmas;
  };
  std::vector<Innovations> innovations;

  bool has_target() const { return !target.t.empty(); }
};

/// Returns whether the folder looks like an output folder of `tandem estimate`, `navigate` or `track`.
bool is_run(const std::filesystem::path& folder);
/// Reads an output folder. Throws Error that names the file if one is missing or malformed.
RunRecord read_run(const std::filesystem::path& folder);

}  // namespace tandem
