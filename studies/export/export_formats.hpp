#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <tandem/studies/export/exported_trajectory.hpp>

namespace tandem {

/// A format of tandem export: writes the files of a run to a folder and returns notes, for example on poses that the
/// format cannot hold.
struct ExportFormat {
  std::string name, help;
  std::vector<std::string> (*write)(const ExportedRun& run, const std::filesystem::path& folder);
};

/// Returns all formats. Files have the names of the trajectories: chaser.txt, target.geojson, …
///
///     tum       t x y z qx qy qz qw; as `evo_traj tum` reads it
///     kitti     the first three rows of each pose matrix; as `evo_traj kitti` reads it
///     csv       t, position, quaternion, Euler angles
///     g2o       VERTEX_SE3:QUAT and EDGE_SE3:QUAT of consecutive poses, with the identity as information
///     geojson   a LineString for each trajectory; needs the origin of the scenario
///     kml       the same, with times
///     mcap      nav_msgs/Odometry in ENU-FLU with covariances, in one ROS 2 bag
const std::vector<ExportFormat>& export_formats();

/// Writers that have separate source files.
std::vector<std::string> export_geojson(const ExportedRun& run, const std::filesystem::path& folder);
std::vector<std::string> export_kml(const ExportedRun& run, const std::filesystem::path& folder);
std::vector<std::string> export_mcap(const ExportedRun& run, const std::filesystem::path& folder);

}  // namespace tandem
