#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <tandem/studies/recording/message_type.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

// The members of common ROS 2 messages, without comments. Bags of ROS 2 before Iron do not embed definitions.
constexpr std::pair<std::string_view, std::string_view> kDefinitions[] = {
    {"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    {"std_msgs/Float64", "float64 data\n"},
    {"std_msgs/Float32", "float32 data\n"},
    {"std_msgs/String", "string data\n"},
    {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"},
    {"geometry_msgs/Pose", "Point position\nQuaternion orientation\n"},
    {"geometry_msgs/Twist", "Vector3 linear\nVector3 angular\n"},
    {"geometry_msgs/Transform", "Vector3 translation\nQuaternion rotation\n"},
    {"geometry_msgs/PoseWithCovariance", "Pose pose\nfloat64[36] covariance\n"},
    {"geometry_msgs/TwistWithCovariance", "Twist twist\nfloat64[36] covariance\n"},
    {"geometry_msgs/PoseStamped", "std_msgs/Header header\nPose pose\n"},
    {"geometry_msgs/PoseWithCovarianceStamped", "std_msgs/Header header\nPoseWithCovariance pose\n"},
    {"geometry_msgs/PointStamped", "std_msgs/Header header\nPoint point\n"},
    {"geometry_msgs/Vector3Stamped", "std_msgs/Header header\nVector3 vector\n"},
    {"geometry_msgs/QuaternionStamped", "std_msgs/Header header\nQuaternion quaternion\n"},
    {"geometry_msgs/TwistStamped", "std_msgs/Header header\nTwist twist\n"},
    {"geometry_msgs/TwistWithCovarianceStamped", "std_msgs/Header header\nTwistWithCovariance twist\n"},
    {"geometry_msgs/TransformStamped", "std_msgs/Header header\nstring child_frame_id\nTransform transform\n"},
    {"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    {"nav_msgs/Odometry",
     "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
     "geometry_msgs/TwistWithCovariance twist\n"},
    {"sensor_msgs/Imu",
     "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
     "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
     "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"},
    {"sensor_msgs/MagneticField",
     "std_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field\nfloat64[9] magnetic_field_covariance\n"},
    {"sensor_msgs/FluidPressure", "std_msgs/Header header\nfloat64 fluid_pressure\nfloat64 variance\n"},
    {"sensor_msgs/Temperature", "std_msgs/Header header\nfloat64 temperature\nfloat64 variance\n"},
    {"sensor_msgs/Range",
     "std_msgs/Header header\nuint8 radiation_type\nfloat32 field_of_view\nfloat32 min_range\nfloat32 max_range\n"
     "float32 range\nfloat32 variance\n"},
    {"sensor_msgs/NavSatStatus", "int8 status\nuint16 service\n"},
    {"sensor_msgs/NavSatFix",
     "std_msgs/Header header\nNavSatStatus status\nfloat64 latitude\nfloat64 longitude\nfloat64 altitude\n"
     "float64[9] position_covariance\nuint8 position_covariance_type\n"},
    {"marine_acoustic_msgs/Dvl",
     "std_msgs/Header header\nuint8 velocity_mode\nuint8 dvl_type\ngeometry_msgs/Vector3 velocity\n"
     "float64[9] velocity_covar\nfloat64 altitude\nfloat64 course_gnd\nfloat64 speed_gnd\nuint8 num_good_beams\n"
     "float32 sound_speed\nbool beam_ranges_valid\nbool beam_velocities_valid\n"
     "geometry_msgs/Vector3[4] beam_unit_vec\nfloat64[4] range\nfloat32[4] range_covar\nfloat32[4] beam_quality\n"
     "float32[4] beam_velocity\nfloat32[4] beam_velocity_covar\n"},
};

std::string_view members_of(std::string_view type) {
  for (const auto& [name, members] : kDefinitions)
    if (name == type) return members;
  return {};
}

/// Adds the definitions of all nested types.
void add_nested(std::string_view type, std::set<std::string>& added, std::string& text) {
  const std::string package(type.substr(0, type.find('/')));
  for (const std::string_view line : split(members_of(type), '\n')) {
    std::string nested(line.substr(0, line.find_first_of(" [")));
    if (nested.find('/') == std::string::npos) nested = package + "/" + nested;
    if (members_of(nested).empty() || !added.insert(nested).second) continue;
    text += "====\nMSG: " + nested + "\n" + std::string(members_of(nested));
    add_nested(nested, added, text);
  }
}

}  // namespace

std::string builtin_definition(const std::string& type) {
  std::string text(members_of(type));
  std::set<std::string> added;
  if (!text.empty()) add_nested(type, added, text);
  return text;
}

}  // namespace tandem
