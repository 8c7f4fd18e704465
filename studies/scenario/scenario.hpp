#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <tandem/problem/navigation/navigation_checks.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/studies/scenario/frame.hpp>

namespace tandem {

/// A scenario folder, read and checked:
///
///     scenario.yaml                         name, description, source, keyframe_interval, noise, sensors, …
///     chaser_odometry.tum                   dead-reckoned chaser poses in the world, at any rate
///     usbl.csv                              t,x,y,z: target position in the chaser's body frame [m]
///     optical.csv                           t,x,y,z,qx,qy,qz,qw: target pose in the chaser's body frame
///     truth_chaser.tum, truth_target.tum    optional; only metrics and plots read them
///
/// Quaternions are Hamilton, x y z w. The key `frame` is ENU-FLU or NED-FRD (see Frame). The key `group` is SE3
/// (spatial) or SE2 (planar). The section `sensors` declares further sensors with these keys:
///
///     type                                  position, pose, range_bearing, bearing, range or usbl_spherical
///     file, sigma                           required
///     position, orientation                 optional: sensor in the chaser's body frame; orientation is a quaternion
///     target_position, target_orientation   optional: marker in the target's body frame (orientation: type pose)
///     delay                                 optional: a row stamped t was valid at t − delay [s]
///     loss, orientation_loss                optional robust losses (orientation_loss: type pose)
///     error                                 optional systematic errors, see read_error()
///     missing                               optional: numbers that stand for missing data
///
/// Sensors of the types imu, dvl, depth, gps and heading are the chaser's own (see scenario_ego.hpp). A folder with
/// such sensors needs neither odometry nor target sensors, and its `noise` needs only the entries for target sensors.
/// The keys `latitude` [deg] and `gravity` [m/s²] apply to them.
struct Scenario {
  std::string name, description, source;
  std::filesystem::path folder;
  Frame frame;                               ///< frame of the files; the members below are converted to ENU-FLU
  TrackingData data;                         ///< without odometry or sensors if the folder has none
  std::optional<NavigationData> navigation;  ///< the chaser's own sensors as in the files, not yet cleaned by check()
  std::vector<Stamped<SE3>> truth_chaser, truth_target;  ///< empty without truth
  bool truth_orientation = true;                         ///< false if the truth has positions only
  std::vector<NavigationFinding> findings;      ///< poses and measurements that screen() has discarded from `data`
  std::vector<std::string> without_extrinsics;  ///< declared sensors that have neither position nor orientation

  /// The files of the streams: one for each sensor of `data` and of `navigation`, in the same order.
  struct Files {
    std::optional<std::filesystem::path> odometry, imu;
    std::vector<std::filesystem::path> target, ego;
  } files;

  bool has_truth() const { return !truth_chaser.empty() && !truth_target.empty(); }
};

/// Reads a scenario folder. Throws Error, with file, line and reason, on anything missing, malformed, unknown or
/// unsupported, and Stopped if `stop` is reached.
Scenario read_scenario(const std::filesystem::path& folder, const Stop& stop = {});

/// The source of the rows of a scenario for read_settings().
enum class RowsIn {
  files,   ///< files of the folder; they must exist but are not read
  stream,  ///< a live stream; odometry, usbl and optical exist if `noise` has entries for them
};

/// Reads a scenario without odometry, measurements, samples and truth.
Scenario read_settings(const std::filesystem::path& folder, RowsIn rows);
/// Reads the settings from the text of a scenario.yaml instead of the file.
Scenario read_settings(const std::string& yaml, const std::filesystem::path& folder, RowsIn rows);
/// Adds the true trajectories that the folder has.
void read_truth(Scenario& scenario, const Stop& stop = {});

}  // namespace tandem
