#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <tandem/studies/export/export_formats.hpp>
#include <tandem/studies/support/output_file.hpp>

namespace tandem {
namespace {

Eigen::Quaterniond rotation(const ExportedPose& pose) {
  const auto& q = *pose.orientation;
  return Eigen::Quaterniond(q[3], q[0], q[1], q[2]);
}

Eigen::Vector3d position(const ExportedPose& pose) { return Eigen::Vector3d(pose.position.data()); }

/// Calls line(pose) for each pose with an orientation and returns a note on the others.
template <class Line>
void each_full_pose(const ExportedTrajectory& trajectory, const char* format, std::vector<std::string>& notes,
                    Line line) {
  std::size_t points = 0;
  for (const ExportedPose& pose : trajectory.poses)
    if (pose.orientation)
      line(pose);
    else
      ++points;
  if (points > 0)
    notes.push_back(
        fmt::format("{}: {} of {} states are points without orientation, which {} cannot hold; they are left "
                    "out",
                    trajectory.name, points, trajectory.poses.size(), format));
}

std::vector<std::string> export_tum(const ExportedRun& run, const std::filesystem::path& folder) {
  std::vector<std::string> notes;
  for (const ExportedTrajectory& trajectory : run.trajectories) {
    std::string text = "# t x y z qx qy qz qw\n";
    each_full_pose(trajectory, "tum", notes, [&](const ExportedPose& p) {
      const auto& q = *p.orientation;
      text += fmt::format("{} {} {} {} {} {} {} {}\n", p.t, p.position[0], p.position[1], p.position[2], q[0], q[1],
                          q[2], q[3]);
    });
    write_file(folder / (trajectory.name + ".tum"), text);
  }
  return notes;
}

std::vector<std::string> export_kitti(const ExportedRun& run, const std::filesystem::path& folder) {
  std::vector<std::string> notes;
  for (const ExportedTrajectory& trajectory : run.trajectories) {
    std::string text;
    each_full_pose(trajectory, "kitti", notes, [&](const ExportedPose& p) {
      const Eigen::Matrix3d R = rotation(p).toRotationMatrix();
      for (int i = 0; i < 3; ++i)
        text += fmt::format("{}{} {} {} {}", i > 0 ? " " : "", R(i, 0), R(i, 1), R(i, 2),
                            p.position[static_cast<std::size_t>(i)]);
      text += '\n';
    });
    write_file(folder / (trajectory.name + ".txt"), text);
  }
  return notes;
}

std::vector<std::string> export_csv(const ExportedRun& run, const std::filesystem::path& folder) {
  constexpr double kDegree = std::numbers::pi / 180;
  for (const ExportedTrajectory& trajectory : run.trajectories) {
    std::string text = "t,x,y,z,qx,qy,qz,qw,roll_deg,pitch_deg,yaw_deg\n";
    for (const ExportedPose& p : trajectory.poses) {
      text += fmt::format("{},{},{},{}", p.t, p.position[0], p.position[1], p.position[2]);
      if (!p.orientation) {
        text += ",,,,,,,\n";
        continue;
      }
      const Eigen::Matrix3d R = rotation(p).toRotationMatrix();
      const auto& q = *p.orientation;
      text += fmt::format(
          ",{},{},{},{},{:.9g},{:.9g},{:.9g}\n", q[0], q[1], q[2], q[3], std::atan2(R(2, 1), R(2, 2)) / kDegree,
          std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0))) / kDegree, std::atan2(R(1, 0), R(0, 0)) / kDegree);
    }
    write_file(folder / (trajectory.name + ".csv"), text);
  }
  return {};
}

std::vector<std::string> export_g2o(const ExportedRun& run, const std::filesystem::path& folder) {
  std::vector<std::string> notes;
  std::size_t id = 0;  // unique over all trajectories, so that the files can be joined
  for (const ExportedTrajectory& trajectory : run.trajectories) {
    std::string vertices, edges;
    const ExportedPose* before = nullptr;
    each_full_pose(trajectory, "g2o", notes, [&](const ExportedPose& p) {
      const auto& q = *p.orientation;
      vertices += fmt::format("VERTEX_SE3:QUAT {} {} {} {} {} {} {} {}\n", id, p.position[0], p.position[1],
                              p.position[2], q[0], q[1], q[2], q[3]);
      if (before) {
        const Eigen::Quaterniond turn = rotation(*before).conjugate() * rotation(p);
        const Eigen::Vector3d step = rotation(*before).conjugate() * (position(p) - position(*before));
        edges += fmt::format("EDGE_SE3:QUAT {} {} {} {} {} {} {} {} {}", id - 1, id, step.x(), step.y(), step.z(),
                             turn.x(), turn.y(), turn.z(), turn.w());
        for (int i = 0; i < 6; ++i)
          for (int j = i; j < 6; ++j) edges += i == j ? " 1" : " 0";
        edges += '\n';
      }
      before = &p;
      ++id;
    });
    write_file(folder / (trajectory.name + ".g2o"), vertices + edges);
  }
  return notes;
}

}  // namespace

const std::vector<ExportFormat>& export_formats() {
  static const std::vector<ExportFormat> formats = {
      {"tum", "t x y z qx qy qz qw, for evo", export_tum},
      {"kitti", "pose matrices without times, for evo", export_kitti},
      {"csv", "positions, quaternions and Euler angles", export_csv},
      {"geojson", "lines of longitude and latitude", export_geojson},
      {"kml", "tracks for Google Earth", export_kml},
      {"mcap", "nav_msgs/Odometry with covariance in a ROS 2 bag", export_mcap},
      {"g2o", "pose graph of consecutive poses", export_g2o}};
  return formats;
}

}  // namespace tandem
