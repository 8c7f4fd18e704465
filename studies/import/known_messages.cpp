#include <string>

#include <tandem/studies/import/known_messages.hpp>

namespace tandem {
namespace {

struct KnownMessage {
  std::string_view type, entry;
  std::string_view field{};  ///< field that the stream must have
};

// ROS messages follow REP 103 (ENU, FLU), ArduPilot and PX4 NED and FRD. The headings of NMEA are clockwise from north.
// Poses and points are those of the target relative to the chaser, and twists are along the chaser's axes. Rows whose
// `frame` is one of the world are dropped. The z axis of a marine_acoustic_msgs/Dvl points where the DVL looks: down.
// Its velocity_mode is 1 for the velocity over ground and 2 for that through the water. Of several rules for a type,
// the first one whose field exists applies.
constexpr KnownMessage kMessages[] = {
    {"sensor_msgs/Imu", R"({type: imu, axes: FLU, fields: {
  acceleration: [linear_acceleration.x, linear_acceleration.y, linear_acceleration.z],
  angular_rate: [angular_velocity.x, angular_velocity.y, angular_velocity.z]}})"},
    {"sensor_msgs/NavSatFix", R"({type: gps, axes: ENU, where: [status.status >= 0],
  fields: {latitude: "latitude [deg]", longitude: "longitude [deg]", height: altitude},
  covariance: ["position_covariance[0]", "position_covariance[4]", "position_covariance[8]"]})"},
    {"sensor_msgs/FluidPressure", R"({type: depth, fields: {pressure: fluid_pressure}})"},
    {"sensor_msgs/MagneticField", R"({type: heading, axes: FLU, north: magnetic, sigma: [3.0, 3.0, 0.1],
  fields: {magnetic_field: [magnetic_field.x, magnetic_field.y, magnetic_field.z]}})"},
    {"nav_msgs/Odometry", R"({type: odometry, axes: ENU-FLU, fields: {
  position: [pose.pose.position.x, pose.pose.position.y, pose.pose.position.z],
  quaternion_xyzw: [pose.pose.orientation.x, pose.pose.orientation.y, pose.pose.orientation.z,
                    pose.pose.orientation.w]}})"},
    {"geometry_msgs/PoseStamped", R"({type: pose, axes: FLU, frame: header.frame_id,
  fields: {
  position: [pose.position.x, pose.position.y, pose.position.z],
  quaternion_xyzw: [pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w]}})"},
    {"geometry_msgs/PoseWithCovarianceStamped", R"({type: pose, axes: FLU, frame: header.frame_id,
  fields: {
  position: [pose.pose.position.x, pose.pose.position.y, pose.pose.position.z],
  quaternion_xyzw: [pose.pose.orientation.x, pose.pose.orientation.y, pose.pose.orientation.z,
                    pose.pose.orientation.w]},
  covariance: ["pose.covariance[0]", "pose.covariance[7]", "pose.covariance[14]", "pose.covariance[21]",
  "pose.covariance[28]", "pose.covariance[35]"]})"},
    {"geometry_msgs/PointStamped", R"({type: position, axes: FLU, frame: header.frame_id,
  fields: {position: [point.x, point.y, point.z]}})"},
    {"geometry_msgs/TwistStamped",
     R"({type: dvl, axes: FLU, frame: header.frame_id, fields: {velocity: [twist.linear.x, twist.linear.y, twist.linear.z]}})"},
    {"geometry_msgs/TwistWithCovarianceStamped", R"({type: dvl, axes: FLU, frame: header.frame_id,
  fields: {velocity: [twist.twist.linear.x, twist.twist.linear.y, twist.twist.linear.z]},
  covariance: ["twist.covariance[0]", "twist.covariance[7]", "twist.covariance[14]"]})"},
    {"marine_acoustic_msgs/Dvl", R"({type: dvl, axes: FRD, where: [velocity_mode = 1, num_good_beams >= 3],
  fields: {velocity: [velocity.x, velocity.y, velocity.z]},
  covariance: ["velocity_covar[0]", "velocity_covar[4]", "velocity_covar[8]"]})"},
    {"NMEA/GGA", R"({type: gps, where: [quality > 0],
  fields: {latitude: "latitude [deg]", longitude: "longitude [deg]", height: altitude}})"},
    {"NMEA/HDT", R"({type: heading, sigma: [3.0, 3.0, 0.02], fields: {heading: "heading [deg]"}})"},
    {"NMEA/HDG", R"({type: heading, sigma: [3.0, 3.0, 0.05], north: "true", fields: {heading: "heading_true [deg]"}})",
     "heading_true"},
    {"NMEA/HDG",
     R"({type: heading, sigma: [3.0, 3.0, 0.05], north: magnetic, fields: {heading: "heading_magnetic [deg]"}})"},
    {"WaterLinked/velocity", R"({type: dvl, axes: FRD, where: [velocity_valid = 1], fields: {velocity: [vx, vy, vz]},
  covariance: ["covariance[0][0]", "covariance[1][1]", "covariance[2][2]"]})"},
    {"WaterLinked/position_local", R"({type: odometry, axes: NED-FRD, fields: {position: [x, y, z],
  roll: "roll [deg]", pitch: "pitch [deg]", yaw: "yaw [deg]"}})"},
    {"ArduPilot/IMU", R"({type: imu, axes: FRD, fields: {acceleration: [AccX, AccY, AccZ],
  angular_rate: [GyrX, GyrY, GyrZ]}})"},
    {"ArduPilot/GPS",
     R"({type: gps, where: [Status >= 3], fields: {latitude: "Lat [deg]", longitude: "Lng [deg]",
  height: Alt}})"},
    {"ArduPilot/ATT", R"({type: heading, axes: NED-FRD, fields: {roll: "Roll [deg]", pitch: "Pitch [deg]",
  yaw: "Yaw [deg]"}})"},
    {"PX4/sensor_combined", R"({type: imu, axes: FRD, fields: {
  acceleration: ["accelerometer_m_s2[0]", "accelerometer_m_s2[1]", "accelerometer_m_s2[2]"],
  angular_rate: ["gyro_rad[0]", "gyro_rad[1]", "gyro_rad[2]"]}})"},
    {"PX4/vehicle_gps_position", R"({type: gps, where: [fix_type >= 3],
  fields: {latitude: "latitude_deg [deg]", longitude: "longitude_deg [deg]", height: "altitude_msl_m [m]"}})",
     "latitude_deg"},
    {"PX4/vehicle_gps_position", R"({type: gps, where: [fix_type >= 3],
  fields: {latitude: "lat [1e-7deg]", longitude: "lon [1e-7deg]", height: "alt [mm]"}})"},
    {"PX4/vehicle_attitude", R"({type: heading, axes: NED-FRD,
  fields: {quaternion_wxyz: ["q[0]", "q[1]", "q[2]", "q[3]"]}})"},
};

}  // namespace

std::string_view known_message(const RecordedStream& stream, bool magnetic) {
  for (const KnownMessage& known : kMessages)
    if (known.type == stream.type && (known.field.empty() || find_field(stream, std::string(known.field))) &&
        !(magnetic && known.field == "heading_true"))
      return known.entry;
  return {};
}

}  // namespace tandem
