#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <tandem/problem/navigation/navigation_data.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/studies/scenario/frame.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>

namespace tandem {

/// Returns the type names of the chaser's own sensors: imu, dvl, depth, gps, heading.
const std::vector<std::string>& ego_types();
/// Returns whether an entry of `sensors:` has one of these types.
bool is_ego_sensor(const YamlSection& entry);

/// Reads one of the chaser's own sensors from its entry in `sensors:` and its file, and adds it to `data`. The columns
/// are:
///
///     imu      t,fx,fy,fz,wx,wy,wz   specific force [m/s²] and angular rate [rad/s] along the axes of the IMU
///     dvl      t,vx,vy,vz            velocity over ground along the body axes [m/s]; the DVL frame is the body frame
///     depth    t,z                   position along the world's z axis [m] (downwards in NED)
///     gps      t,x,y,z               position along the world axes [m]
///     heading  t,qx,qy,qz,qw         orientation of the sensor in the world
///
/// Keys of an IMU: accelerometer, gyroscope, accelerometer_bias_walk and gyroscope_bias_walk (see ImuNoise). Optional:
/// integration, initial_accelerometer_bias, initial_gyroscope_bias, max_gap, max_specific_force, max_angular_rate,
/// delay, position, orientation.
///
/// Keys of the other sensors: sigma, one for each column (heading: three, about the body axes). Optional: delay, loss,
/// error, position (depth, gps), orientation (heading).
///
/// Times may be in any order; check() in problem/navigation/navigation_checks.hpp cleans them. If `rows` is false,
/// reads only the settings. Throws Error with file, line and reason, and Stopped if `stop` is reached.
void read_ego_sensor(const std::string& name, const YamlSection& entry, const std::filesystem::path& folder,
                     const Frame& frame, NavigationData& data, bool rows = true, const Stop& stop = {});

/// Reads the keys `latitude` [deg] and `gravity` [m/s², a magnitude]. Without a latitude, the world is inertial (no
/// Earth rotation). Without gravity, uses normal gravity at the latitude, or standard gravity if there is none.
Earth read_earth(const YamlSection& yaml);

/// Returns the first and last time of all samples and measurements [s], or nothing if there are none.
std::optional<std::pair<double, double>> time_span(const NavigationData& data);

}  // namespace tandem
