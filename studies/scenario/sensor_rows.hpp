#pragma once

#include <string>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/navigation_data.hpp>
#include <tandem/problem/tracking/target_sensor.hpp>
#include <tandem/studies/scenario/frame.hpp>

namespace tandem {

/// What the rows of a sensor mean, be they of a file or of a live stream. A row is the numbers of the columns that are
/// named here, t [s] first, in the scenario's frame; what comes out is in ENU-FLU. Each throws Error that says what is
/// wrong with the row, but not where it is (see located).

std::string columns(SensorType type, bool planar);
inline std::string columns(EgoSensorType type) { return std::string(type->columns); }
inline constexpr const char* imu_columns = "t,fx,fy,fz,wx,wy,wz";
inline constexpr const char* pose_columns = "t,x,y,z,qx,qy,qz,qw";

/// Whether such a sensor may see the target more than once at one time.
bool may_repeat_times(SensorType type);

Measurement target_measurement(SensorType type, const double* row, const Frame& frame, bool planar);
EgoMeasurement ego_measurement(EgoSensorType type, const double* row, const Frame& frame);
/// The numbers of such a row behind its time, of a measurement in ENU-FLU.
Eigen::VectorXd numbers(EgoSensorType type, const EgoMeasurement& m);
ImuSample imu_sample(const double* row, const Frame& frame);
/// A pose in the world, out of the columns of pose_columns.
Stamped<SE3> world_pose(const double* row, const Frame& frame, bool planar);
/// The same of a pose that is read already.
SE3 inner_pose(const SE3& as_written, const Frame& frame, bool planar);

/// f(), with where() put before the sentence of an Error that it throws.
template <class Where, class F>
auto located(Where where, F f) {
  try {
    return f();
  } catch (const Error& error) {
    throw Error(where() + ": " + error.what());
  }
}

}  // namespace tandem
