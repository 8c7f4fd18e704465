#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <tandem/studies/export/export_formats.hpp>
#include <tandem/studies/recording/message_type.hpp>
#include <tandem/studies/support/output_file.hpp>

namespace tandem {
namespace {

constexpr double kUnknownVariance = 1e6;  // rad²; of the orientation of a point
constexpr char kMagic[] = "\x89MCAP0\r\n";

/// Little-endian bytes, with the alignment of CDR relative to the start.
class Bytes {
 public:
  template <class T>
  Bytes& add(T value) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if constexpr (std::endian::native == std::endian::big) std::reverse(raw, raw + sizeof(T));
    bytes_.append(raw, sizeof(T));
    return *this;
  }
  template <class T>
  Bytes& aligned(T value) {
    while (bytes_.size() % sizeof(T) != 0) bytes_ += '\0';
    return add(value);
  }
  /// Adds a text after its length of 32 bits.
  Bytes& text(std::string_view text) {
    add(static_cast<std::uint32_t>(text.size()));
    bytes_ += text;
    return *this;
  }
  /// Adds a text as CDR has it: aligned, and with a final zero.
  Bytes& cdr_text(std::string_view text) {
    aligned(static_cast<std::uint32_t>(text.size() + 1));
    bytes_ += text;
    bytes_ += '\0';
    return *this;
  }
  const std::string& str() const { return bytes_; }

 private:
  std::string bytes_;
};

std::string record(unsigned char opcode, const std::string& content) {
  Bytes bytes;
  bytes.add(opcode).add(static_cast<std::uint64_t>(content.size()));
  return bytes.str() + content;
}

/// A pose in ENU-FLU with the covariance of nav_msgs/Odometry: position and rotation along the fixed axes of the world.
struct OdometryPose {
  Eigen::Vector3d position, velocity, angular_velocity;
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

OdometryPose odometry_pose(const ExportedPose& pose, bool ned) {
  Eigen::Matrix3d W = Eigen::Matrix3d::Identity(), B = W;  // from the run's axes to ENU and FLU
  if (ned) {
    W << 0, 1, 0, 1, 0, 0, 0, 0, -1;
    B = Eigen::Vector3d(1, -1, -1).asDiagonal();
  }
  OdometryPose result;
  result.position = W * Eigen::Vector3d(pose.position.data());
  result.velocity = B * Eigen::Vector3d(pose.velocity.data());
  result.angular_velocity = B * Eigen::Vector3d(pose.angular_velocity.data());
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  if (pose.orientation) {
    const auto& q = *pose.orientation;
    R = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix();
    result.orientation = Eigen::Quaterniond(W * R * B.transpose()).normalized();
  } else {
    result.covariance.bottomRightCorner<3, 3>().diagonal().setConstant(kUnknownVariance);
  }
  if (pose.covariance.size() == 9) {
    const Eigen::Map<const Eigen::Matrix3d> C(pose.covariance.data());
    result.covariance.topLeftCorner<3, 3>() = W * C * W.transpose();
  } else if (pose.covariance.size() == 36) {
    const Eigen::Map<const Eigen::Matrix<double, 6, 6>> C(pose.covariance.data());
    Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
    A.topLeftCorner<3, 3>() = W * R;
    A.bottomRightCorner<3, 3>() = W * R;
    result.covariance = A * C * A.transpose();
  }
  return result;
}

/// Returns a serialised nav_msgs/Odometry.
std::string odometry_message(const ExportedPose& exported, const std::string& name, bool ned) {
  const OdometryPose pose = odometry_pose(exported, ned);
  const double seconds = std::floor(exported.t);
  Bytes body;
  body.aligned(static_cast<std::int32_t>(seconds));
  body.aligned(static_cast<std::uint32_t>(std::min(999999999.0, std::round((exported.t - seconds) * 1e9))));
  body.cdr_text("map").cdr_text(name);
  for (int i = 0; i < 3; ++i) body.aligned(pose.position[i]);
  for (const double q : {pose.orientation.x(), pose.orientation.y(), pose.orientation.z(), pose.orientation.w()})
    body.aligned(q);
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) body.aligned(pose.covariance(i, j));
  for (int i = 0; i < 3; ++i) body.aligned(pose.velocity[i]);
  for (int i = 0; i < 3; ++i) body.aligned(pose.angular_velocity[i]);
  for (int i = 0; i < 36; ++i) body.aligned(0.0);  // the covariance of the twist is not known
  return std::string("\x00\x01\x00\x00", 4) + body.str();
}

}  // namespace

std::vector<std::string> export_mcap(const ExportedRun& run, const std::filesystem::path& folder) {
  OutputFile file(folder / "run.mcap");
  const std::string magic(kMagic, 8);
  file.write(magic);
  file.write(record(1, Bytes().text("ros2").text("tandem").str()));
  const std::uint16_t schema = 1;
  file.write(record(3, Bytes()
                           .add(schema)
                           .text("nav_msgs/msg/Odometry")
                           .text("ros2msg")
                           .text(builtin_definition("nav_msgs/Odometry"))
                           .str()));
  std::uint16_t channel = 0;
  for (const ExportedTrajectory& trajectory : run.trajectories) {
    ++channel;
    file.write(record(4, Bytes()
                             .add(channel)
                             .add(schema)
                             .text(fmt::format("/{}/odometry", trajectory.name))
                             .text("cdr")
                             .add(std::uint32_t(0))  // no metadata
                             .str()));
    std::uint32_t sequence = 0;
    for (const ExportedPose& pose : trajectory.poses) {
      const auto time = static_cast<std::uint64_t>(std::llround(std::max(0.0, pose.t) * 1e9));
      file.write(record(5, Bytes().add(channel).add(sequence++).add(time).add(time).str() +
                               odometry_message(pose, trajectory.name, run.ned)));
    }
  }
  file.write(record(15, Bytes().add(std::uint32_t(0)).str()));                                             // data end
  file.write(record(2, Bytes().add(std::uint64_t(0)).add(std::uint64_t(0)).add(std::uint32_t(0)).str()));  // footer
  file.write(magic);
  file.close();
  return {};
}

}  // namespace tandem
