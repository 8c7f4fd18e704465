#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tandem {

/// What a run's --out folder has of trajectories and errors, as columns; times from the first one on [s].
struct RunRecord {
  std::string scenario, model, solver, status;
  struct Path {
    std::vector<double> t, x, y, z;  ///< s, m
  };
  Path chaser, target, chaser_truth, target_truth, fixes;
  std::vector<std::string> fix_types;                     ///< usbl, optical or gps, one each a fix
  std::vector<double> t;                                  ///< of errors
  std::vector<std::string> types;                         ///< of keyframes
  std::vector<double> position_error, orientation_error;  ///< m, deg; nan where there is none
  std::vector<double> error[3], three_sigma[3];           ///< m, along the chaser's axes; without a target the world's
  std::vector<std::vector<std::string>> table;            ///< errors by type: of summary.json
  struct Innovations {                                    ///< of a sensor of `tandem track`
    std::string sensor;
    std::vector<double> t, sigmas;
  };
  std::vector<Innovations> innovations;

  bool has_target() const { return !target.t.empty(); }
};

/// Whether the folder is one of `tandem estimate`, `navigate` or `track`.
bool is_run(const std::filesystem::path& folder);
/// Throws Error, naming the file, where one is missing or malformed.
RunRecord read_run(const std::filesystem::path& folder);

}  // namespace tandem
