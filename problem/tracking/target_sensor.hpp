#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem {

/// What a sensor on the chaser measures of the target, seen from the sensor's own frame.
enum class SensorType {
  position,        ///< x y z [m]
  pose,            ///< x y z [m] and a rotation
  range_bearing,   ///< range [m] and direction; in the plane, range and angle
  bearing,         ///< direction; in the plane, an angle [rad]
  range,           ///< [m]
  usbl_spherical,  ///< range [m], azimuth and elevation [rad], each with a sigma of its own; not in the plane
};

/// "position", "pose", "range_bearing", …
std::string_view name(SensorType type);
/// Rows of such a sensor's residual: standard deviations it needs. 0 where the plane has no such sensor.
int rows(SensorType type, bool planar);

/// One measurement; the sensor's type says which fields count.
struct Measurement {
  double t = 0;                                  ///< s, as stamped
  Vector<3> position = Vector<3>::Zero();        ///< m; position and pose
  SO3 rotation{};                                ///< pose
  double range = 0, azimuth = 0, elevation = 0;  ///< m, rad: azimuth from x towards y, elevation from there towards z
  bool held_out = false;                         ///< has a keyframe but no residual: to validate a prediction with
};

/// A sensor on the chaser that observes the target.
struct TargetSensor {
  std::string name;
  SensorType type = SensorType::position;
  Eigen::VectorXd sigma{};                 ///< one a row [m, rad]
  SE3 mount{};                             ///< B: sensor in the chaser's body
  SE3 marker{};                            ///< F: what it sees, in the target's body
  double delay = 0;                        ///< s: a measurement stamped t was valid at t − delay
  std::optional<Loss> loss{};              ///< in place of the problem's; with orientation_loss, on the position alone
  std::optional<Loss> orientation_loss{};  ///< of a pose's orientation: position and orientation are then two residuals
  std::vector<Measurement> measurements{};

  double valid_at(const Measurement& m) const { return m.t - delay; }
  /// The measured position of the target's marker in the sensor's frame [m], where one measurement gives it.
  std::optional<Vector<3>> position(const Measurement& m) const;
  /// The measured pose of the target itself in the chaser's body; of a pose sensor.
  SE3 pose_in_chaser(const Measurement& m) const;
  /// The measured position of the target itself in the chaser's body [m]; a marker's lever arm counts for a pose alone,
  /// since the others do not tell where it points.
  std::optional<Vector<3>> position_in_chaser(const Measurement& m) const;
};

}  // namespace tandem
