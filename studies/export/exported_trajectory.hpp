#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/import/geodesy.hpp>

namespace tandem {

/// A pose of a written trajectory, in the axes of its run.
struct ExportedPose {
  double t;                                              ///< s
  std::array<double, 3> position;                        ///< m
  std::optional<std::array<double, 4>> orientation;      ///< x y z w.
  std::array<double, 3> velocity{}, angular_velocity{};  ///< Along the body's axes; zero if the run has none.
  /// Covariance of the pose, row by row: position and rotation as right perturbations (body axes) [m, rad]; for points
  /// only the first three rows and columns, along the world's axes. Empty if the run has none.
  std::vector<double> covariance{};
};

struct ExportedTrajectory {
  std::string name;  ///< "chaser"
  std::vector<ExportedPose> poses;
};

/// The trajectories of an output folder, or of a scenario folder.
struct ExportedRun {
  bool ned = false;  ///< whether the axes are NED-FRD, not ENU-FLU
  std::vector<ExportedTrajectory> trajectories;
  std::optional<GeographicPoint> origin{};  ///< if the scenario states it
};

/// Reads the trajectories (*.tum) of a folder that have poses, with their covariances. Throws Error if there are none.
ExportedRun read_exported_run(const std::filesystem::path& folder);

}  // namespace tandem
