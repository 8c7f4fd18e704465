#pragma once

#include <span>
#include <string>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/navigation_data.hpp>
#include <tandem/problem/tracking/target_sensor.hpp>
#include <tandem/studies/scenario/frame.hpp>

namespace tandem {

/// Conversions of rows of files and live streams to measurements. A row has the numbers of the columns named here, t
/// [s] first, in the frame of the scenario; the results are in ENU-FLU. The functions throw Error with the reason but
/// without the location of the row; with_location() adds it.

/// Comma-separated names of the columns of a sensor type.
std::string columns(SensorType type, bool planar);
inline std::string columns(EgoSensorType type) { return std::string(type->columns); }
inline constexpr const char* imu_columns = "t,fx,fy,fz,wx,wy,wz";
inline constexpr const char* pose_columns = "t,x,y,z,qx,qy,qz,qw";

/// Returns whether a sensor of this type may have several measurements at the same time.
bool may_repeat_times(SensorType type);

/// Returns whether the values of a row, without its time, stand for missing data. This is the case if a value is NaN,
/// one of `declared`, ±9999, ±99999 or -32768, or if all values are ±32.768 (a DVL without bottom lock). The following
/// functions return NaN for such a row, for a zero quaternion and for a zero range.
bool is_missing(std::span<const double> values, std::span<const double> declared);

Measurement target_measurement(SensorType type, const double* row, const Frame& frame, bool planar,
                               std::span<const double> missing = {});
EgoMeasurement ego_measurement(EgoSensorType type, const double* row, const Frame& frame,
                               std::span<const double> missing = {});
/// Returns the row of a measurement in ENU-FLU, without its time.
Eigen::VectorXd numbers(EgoSensorType type, const EgoMeasurement& m);
ImuSample imu_sample(const double* row, const Frame& frame, std::span<const double> missing = {});
/// Returns whether a row of `pose_columns` stands for a missing pose; see is_missing().
bool is_missing_pose(const double* row);
/// Returns a pose in the world from a row of `pose_columns`; NaN if it is missing.
Stamped<SE3> world_pose(const double* row, const Frame& frame, bool planar);
/// Converts a pose in the frame of the files to ENU-FLU, and projects it onto the plane if `planar`.
SE3 internal_pose(const SE3& as_written, const Frame& frame, bool planar);

/// Returns f(). If it throws Error, puts where() in front of the message.
template <class Where, class F>
auto with_location(Where where, F f) {
  try {
    return f();
  } catch (const Error& error) {
    throw Error(where() + ": " + error.what());
  }
}

}  // namespace tandem
