#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/problem/navigation/systematic_error.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem {

namespace detail {

template <LieGroup G>
struct TrackingBuild;

/// Location of a measurement in the data and among the keyframes.
struct Placing {
  std::size_t sensor, index;         ///< indices in TrackingData::sensors and TargetSensor::measurements
  std::size_t keyframe;              ///< last keyframe at or before the measurement
  std::optional<double> fraction{};  ///< fraction of the interval to the next keyframe; nullopt: at the keyframe
};
template <LieGroup G>
using Place = void(TrackingBuild<G>& build, const Placing& at);

/// Functions that add a measurement of a sensor type to a problem, in space and in the plane. Null: not supported.
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

/// Placement with the residual that P creates (see SensorBuild). placed_by supports space and plane, placed_in_space_by
/// only space.
template <class P>
inline constexpr Placement placed_by{&place<P, SE3>, &place<P, SE2>};
template <class P>
inline constexpr Placement placed_in_space_by{&place<P, SE3>, nullptr};

}  // namespace detail

/// Bit flags of the fields of Measurement that a sensor measures, in the order of a file's columns.
namespace measured {
inline constexpr unsigned position = 1;   ///< x y z [m]; in the plane x y.
inline constexpr unsigned rotation = 2;   ///< In space, a rotation; in the plane, an angle [rad].
inline constexpr unsigned range = 4;      ///< m
inline constexpr unsigned direction = 8;  ///< Azimuth and elevation as a point on the sphere; in the plane, an angle.
inline constexpr unsigned angles = 16;    ///< Azimuth and elevation as two angles [rad]; singular at the poles.
inline constexpr unsigned height = 32;    ///< z, up [m].
}  // namespace measured

/// Properties of one type of target sensor, except for its residual. File readers, online feeds and problem builders
/// use them. The table of all types is in target_sensor.cpp.
struct SensorTraits {
  std::string_view name;  ///< name in scenario.yaml and messages
  unsigned parts;         ///< flags of namespace `measured`
  detail::Placement place;

  constexpr bool has(unsigned any_of) const { return (parts & any_of) != 0; }
};

/// Type of a sensor on the chaser that observes the target in the sensor's frame: a reference to traits, either from
/// the table or user-defined. User-defined traits must outlive it.
class SensorType {
 public:
  constexpr SensorType(const SensorTraits& traits) : traits_(&traits) {}
  constexpr const SensorTraits* operator->() const { return traits_; }
  friend constexpr bool operator==(SensorType, SensorType) = default;

  static const SensorType position;        ///< Position [m].
  static const SensorType pose;            ///< Position [m] and rotation.
  static const SensorType range_bearing;   ///< Range [m] and direction; in the plane, range and angle.
  static const SensorType bearing;         ///< Direction; in the plane, an angle [rad].
  static const SensorType range;           ///< Range [m].
  static const SensorType usbl_spherical;  ///< Range [m], azimuth and elevation [rad]; not in the plane.

 private:
  const SensorTraits* traits_;
};

/// Returns the table of all types that a scenario may name.
std::span<const SensorTraits> sensor_types();
/// Returns "position", "pose", "range_bearing", …
inline std::string_view name(SensorType type) { return type->name; }
/// Returns the number of residual rows and standard deviations; 0 if planar problems do not support the type.
int rows(SensorType type, bool planar);

/// One measurement of the target. The type of the sensor determines which fields are used.
struct Measurement {
  double t = 0;                                  ///< time stamp [s]
  Vector<3> position = Vector<3>::Zero();        ///< m
  SO3 rotation{};                                ///< target in the sensor
  double range = 0, azimuth = 0, elevation = 0;  ///< m, rad; azimuth from x towards y, elevation from there towards z
  bool held_out = false;                         ///< whether it gets a keyframe but no residual, for validation
  double height = 0;                             ///< up [m]
};

/// A sensor on the chaser that observes the target.
struct TargetSensor {
  std::string name;
  SensorType type = SensorType::position;
  Eigen::VectorXd sigma{};                 ///< one per residual row [m, rad]
  SE3 mount{};                             ///< B: sensor in the chaser's body
  SE3 marker{};                            ///< F: observed marker in the target's body
  double delay = 0;                        ///< s; a measurement stamped t was valid at t − delay
  std::optional<Loss> loss{};              ///< replaces TrackingOptions::loss
  std::optional<Loss> orientation_loss{};  ///< replaces TrackingOptions::orientation_loss; for pose sensors
  std::vector<double> missing{};           ///< numbers in files and streams that stand for missing data
  std::vector<Measurement> measurements{};
  std::optional<SystematicError> error{};  ///< systematic errors to estimate

  double valid_at(const Measurement& m) const { return m.t - delay; }  ///< time of validity [s]
  /// Returns the measured position of the marker in the sensor's frame [m]; nullopt if the sensor does not measure it.
  std::optional<Vector<3>> position(const Measurement& m) const;
  /// Returns the measured pose of the target's body in the chaser's body, for a pose sensor.
  SE3 pose_in_chaser(const Measurement& m) const;
  /// Returns the measured position of the target's body in the chaser's body [m], or nullopt. Only a pose sensor
  /// accounts for the marker's lever arm, because other sensors do not measure its direction.
  std::optional<Vector<3>> position_in_chaser(const Measurement& m) const;
};
/// Returns why the sensor cannot have its systematic errors, or an empty string.
std::string why_unsupported(const TargetSensor& sensor);

}  // namespace tandem
