#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <tandem/problem/navigation/navigation_data.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/studies/scenario/frame.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>

namespace tandem {

/// What an entry of `sensors:` may call its type when it is one of the chaser's own: imu, dvl, depth, gps, heading.
const std::vector<std::string>& ego_types();
/// Whether an entry has such a type.
bool is_ego_sensor(const YamlSection& entry);

/// Adds one of the chaser's own sensors, out of its entry in `sensors:` and its file:
///
///     imu      t,fx,fy,fz,wx,wy,wz   specific force [m/s²] and angular rate [rad/s], along its own axes
///     dvl      t,vx,vy,vz            velocity over ground along the body's axes [m/s]; the body frame is the DVL's
///     depth    t,z                   along the world's z [m]: in NED downwards
///     gps      t,x,y,z               along the world's axes [m]
///     heading  t,qx,qy,qz,qw         sensor in the world
///
/// An IMU's keys: accelerometer, gyroscope, accelerometer_bias_walk, gyroscope_bias_walk (see ImuNoise) and, optionally,
/// integration, initial_accelerometer_bias, initial_gyroscope_bias, max_gap, max_specific_force, max_angular_rate. The
/// others': sigma (one a column of the file, of a heading three about the body's axes), and optionally delay, loss,
/// position (depth, gps) and orientation (heading). An IMU has position and orientation.
///
/// Times are kept as they are in the file, in any order: see check() in problem/navigation_checks.hpp. Throws Error
/// naming file, line and reason, and Stopped when it is to stop. Without `rows`, settings alone are read, not the file.
void read_ego_sensor(const std::string& name, const YamlSection& entry, const std::filesystem::path& folder,
                     const Frame& frame, NavigationData& data, bool rows = true, const Stop& stop = {});

/// The keys `latitude` [deg], without which the world counts as inertial, and `gravity` [m/s²], a magnitude: where it is
/// not given, normal gravity at the latitude or, without that either, standard gravity.
Earth read_earth(const YamlSection& yaml);

/// The first and the last time of all the sensors' samples [s]; of none, nothing.
std::optional<std::pair<double, double>> time_span(const NavigationData& data);

}  // namespace tandem
