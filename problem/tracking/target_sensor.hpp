#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/problem/navigation/staying_error.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem {

namespace detail {

template <LieGroup G>
struct TrackingBuild;

/// Where a measurement of a target joins its problem.
struct Placing {
  std::size_t sensor, index;  ///< in the data
  std::size_t keyframe;
  std::optional<double> fraction{};  ///< of the way to the next keyframe, of an instant in between
};
template <LieGroup G>
using Place = void(TrackingBuild<G>& build, const Placing& at);

/// How a kind of sensor joins a problem, in space and, where it can, in the plane.
struct Placement {
  Place<SE3>* in_space = nullptr;
  Place<SE2>* in_plane = nullptr;

  template <LieGroup G>
  Place<G>* of() const {
    if constexpr (G::point_dim == 2) {
      return in_plane;
    } else {
      return in_space;
    }
  }
};

template <class P, LieGroup G>
void place(TrackingBuild<G>& build, const Placing& at);

/// By P, of which sensor_build.hpp tells.
template <class P>
inline constexpr Placement placed_by{&place<P, SE3>, &place<P, SE2>};
template <class P>
inline constexpr Placement placed_in_space_by{&place<P, SE3>, nullptr};

}  // namespace detail

/// What a measurement of a target may consist of: fields of Measurement, in the order of a file's columns.
namespace measured {
inline constexpr unsigned position = 1;   ///< x y z [m]; in the plane x y
inline constexpr unsigned rotation = 2;   ///< in the plane, an angle [rad]
inline constexpr unsigned range = 4;      ///< [m]
inline constexpr unsigned direction = 8;  ///< on the sphere, from azimuth and elevation; in the plane, an angle [rad]
inline constexpr unsigned angles = 16;    ///< azimuth and elevation [rad] themselves, which the pole does not have
inline constexpr unsigned height = 32;    ///< a value [m] along z, up
}  // namespace measured

/// All that is said of one kind of sensor outside of its residual: reading files and live lines, and the builders, go by
/// this. Its rows are a table in target_sensor.cpp.
struct SensorTraits {
  std::string_view name;  ///< in scenario.yaml and messages
  unsigned parts;         ///< of `measured`
  detail::Placement place;

  constexpr bool has(unsigned any_of) const { return (parts & any_of) != 0; }
};

/// What a sensor on the chaser measures of the target, seen from the sensor's own frame: a handle of one row of traits,
/// of the table or of one's own (which has to outlive it).
class SensorType {
 public:
  constexpr SensorType(const SensorTraits& traits) : traits_(&traits) {}
  constexpr const SensorTraits* operator->() const { return traits_; }
  friend constexpr bool operator==(SensorType, SensorType) = default;

  static const SensorType position;        ///< x y z [m]
  static const SensorType pose;            ///< x y z [m] and a rotation
  static const SensorType range_bearing;   ///< range [m] and direction; in the plane, range and angle
  static const SensorType bearing;         ///< direction; in the plane, an angle [rad]
  static const SensorType range;           ///< [m]
  static const SensorType usbl_spherical;  ///< range, azimuth and elevation, each with a sigma; not in the plane

 private:
  const SensorTraits* traits_;
};

/// The table: all kinds that a scenario may name.
std::span<const SensorTraits> sensor_types();
/// "position", "pose", "range_bearing", …
inline std::string_view name(SensorType type) { return type->name; }
/// Rows of such a sensor's residual: standard deviations it needs. 0 where the plane has no such sensor.
int rows(SensorType type, bool planar);

/// One measurement; the sensor's type says which fields count.
struct Measurement {
  double t = 0;                                  ///< s, as stamped
  Vector<3> position = Vector<3>::Zero();        ///< m; position and pose
  SO3 rotation{};                                ///< pose
  double range = 0, azimuth = 0, elevation = 0;  ///< m, rad: azimuth from x towards y, elevation from there towards z
  bool held_out = false;                         ///< has a keyframe but no residual: to validate a prediction with
  double height = 0;                             ///< m, up
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
  std::optional<StayingError> error{};  ///< beside its noise

  double valid_at(const Measurement& m) const { return m.t - delay; }
  /// The measured position of the target's marker in the sensor's frame [m], where one measurement gives it.
  std::optional<Vector<3>> position(const Measurement& m) const;
  /// The measured pose of the target itself in the chaser's body; of a pose sensor.
  SE3 pose_in_chaser(const Measurement& m) const;
  /// The measured position of the target itself in the chaser's body [m]; a marker's lever arm counts for a pose alone,
  /// since the others do not tell where it points.
  std::optional<Vector<3>> position_in_chaser(const Measurement& m) const;
};
/// Empty, or why the sensor cannot have the errors that stay which it is given.
std::string why_not(const TargetSensor& sensor);

}  // namespace tandem
