#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <tandem/problem/navigation/navigation_data.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/studies/scenario/frame.hpp>

namespace tandem {

/// A scenario folder, read and checked:
///
///     scenario.yaml                         name, description, source, keyframe_interval, noise, sensors, …
///     chaser_odometry.tum                   dead-reckoned chaser poses at their own rate
///     usbl.csv                              t,x,y,z: target position in the chaser's body [m]
///     optical.csv                           t,x,y,z,qx,qy,qz,qw: target pose in the chaser's body
///     truth_chaser.tum, truth_target.tum    optional; read by metrics and plots alone
///
/// Quaternions are Hamilton, x y z w. `frame` says which axes the files are in (ENU-FLU: world z up, body x forward, y
/// left, z up; or NED-FRD), `group` whether the problem is spatial (SE3) or planar (SE2). `sensors` declares more: type
/// (position, pose, range_bearing, bearing, range, usbl_spherical), file, sigma, and optionally position and orientation
/// (a quaternion) of the sensor in the chaser's body, target_position and (pose) target_orientation of what it sees in
/// the target's, delay (a line stamped t was valid at t − delay), loss and (pose) orientation_loss.
///
/// Sensors of the types imu, dvl, depth, gps and heading are the chaser's own (see scenario_ego.hpp). A folder that has
/// some needs neither odometry nor sensors of a target, and of `noise` only what its target sensors ask for; `latitude`
/// [deg] and `gravity` [m/s²] say where it is.
struct Scenario {
  std::string name, description, source;
  std::filesystem::path folder;
  Frame frame;        ///< of the files, read and written; everything here is in ENU-FLU
  TrackingData data;  ///< without odometry or sensors where `navigation` is there and the folder has none
  std::optional<NavigationData> navigation;  ///< by the chaser's own sensors, as in the files: check() is to clean it
  std::vector<Stamped<SE3>> truth_chaser, truth_target;  ///< empty where there is none
  bool truth_orientation = true;                         ///< false: the truth has positions only
  std::vector<std::string> without_extrinsics;  ///< declared sensors that give neither position nor orientation

  /// Where the rows of each are, one each a sensor of `data` and of `navigation`.
  struct Files {
    std::optional<std::filesystem::path> odometry, imu;
    std::vector<std::filesystem::path> target, ego;
  } files;

  bool has_truth() const { return !truth_chaser.empty() && !truth_target.empty(); }
};

/// Throws Error, naming file, line and reason, on anything that is missing, malformed, unknown or not
/// supported, and Stopped when it is to stop.
Scenario read_scenario(const std::filesystem::path& folder, const Stop& stop = {});

/// Where the rows of a scenario are, of which settings alone are read.
enum class RowsIn {
  files,   ///< in the folder's files, which are looked for but not read
  stream,  ///< come from elsewhere: chaser_odometry.tum, usbl and optical are there when `noise` has them
};

/// The same without odometry, measurements, samples and truth.
Scenario read_settings(const std::filesystem::path& folder, RowsIn rows);
/// The same of what the folder's scenario.yaml would hold.
Scenario read_settings(const std::string& yaml, const std::filesystem::path& folder, RowsIn rows);
/// Adds the truth, where there is one, to settings.
void read_truth(Scenario& scenario, const Stop& stop = {});

}  // namespace tandem
