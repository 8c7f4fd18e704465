#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/lie/sek3.hpp>
#include <tandem/problem/navigation/systematic_error.hpp>
#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/residuals/earth.hpp>
#include <tandem/residuals/imu_preintegration.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem {

/// Inertial sensor of the chaser.
struct ImuSensor {
  std::string name = "imu";
  SE3 mount{};  ///< sensor in the body
  ImuNoise noise{};
  /// Prior standard deviations of the initial biases [m/s², rad/s]. If they are not given, accelerometer_bias_sigma()
  /// and gyroscope_bias_sigma() derive them from the noise.
  std::optional<double> initial_accelerometer_bias{}, initial_gyroscope_bias{};
  double max_gap = 0.5;           ///< Maximum time between samples [s]; longer gaps split the chain (EgoChain::splits).
  double max_specific_force = 0;  ///< Saturation limit of each axis [m/s²]; 0: unknown.
  double max_angular_rate = 0;    ///< Saturation limit of each axis [rad/s]; 0: unknown.
  /// Delay of the time stamps [s], already subtracted from the times of `samples`. It is negative if stamps are early,
  /// e.g. by half a sample period if a sample is the mean over the interval after its stamp.
  double delay = 0;
  std::vector<double> missing{};     ///< numbers in files and streams that stand for missing data
  std::vector<ImuSample> samples{};  ///< in time order

  /// Sets the delay and shifts the samples accordingly.
  void set_delay(double seconds) {
    for (ImuSample& sample : samples) sample.t += delay - seconds;
    delay = seconds;
  }

  /// Returns the prior sigma of the accelerometer bias: as given, or 100 s^½ times its noise, at most 0.5 m/s².
  double accelerometer_bias_sigma() const {
    return initial_accelerometer_bias.value_or(std::min(100 * noise.accelerometer, 0.5));
  }
  /// Returns the prior sigma of the gyroscope bias: as given, or 1000 s^½ times its noise, at most 0.1 rad/s.
  double gyroscope_bias_sigma() const { return initial_gyroscope_bias.value_or(std::min(1000 * noise.gyroscope, 0.1)); }
};

struct Block;
struct EgoMeasurement;
struct EgoSensor;
namespace detail {
struct EgoPlacing;
}

/// Kind of quantity that a sensor measures. Conversions between frames depend on it.
enum class EgoReading {
  body_vector,   ///< EgoMeasurement::value, along body axes
  world_vector,  ///< EgoMeasurement::value, along world axes
  world_height,  ///< EgoMeasurement::value.z(), up
  orientation,   ///< EgoMeasurement::rotation, sensor in the world
};

/// Extrinsics that a scenario may give for a sensor.
enum class EgoMounting { none, position, orientation };

/// Properties of one type of the chaser's sensors, except for its residual. File readers, online feeds, checks,
/// simulation and problem builders use them. The table of all types is in navigation_data.cpp.
struct EgoSensorTraits {
  std::string_view name;     ///< name in scenario.yaml and messages
  std::string_view columns;  ///< columns of its files, the time t [s] first
  EgoReading reading;
  EgoMounting mounting;
  /// Upper limit of the readings' magnitude. Above it, check() throws "NAME: the QUANTITY is 1500 UNIT, HINT".
  double max_magnitude;
  std::string_view quantity, unit, hint;
  bool may_repeat;  ///< whether a working sensor can repeat the same value for several seconds
  /// Returns the noise-free measurement at time t, given the body's pose and its velocity in the world [m/s].
  EgoMeasurement (*ideal)(const EgoSensor& sensor, double t, const SE3& pose, const Vector<3>& velocity);
  /// Adds a measurement to a problem (see ego_placement.hpp).
  Block (*place)(const detail::EgoPlacing& at, const EgoMeasurement& m);
};

/// Type of a sensor: a reference to traits, either from the table or user-defined. User-defined traits must outlive it.
class EgoSensorType {
 public:
  constexpr EgoSensorType(const EgoSensorTraits& traits) : traits_(&traits) {}
  constexpr const EgoSensorTraits* operator->() const { return traits_; }
  constexpr const EgoSensorTraits& traits() const { return *traits_; }
  friend constexpr bool operator==(EgoSensorType, EgoSensorType) = default;

  static const EgoSensorType dvl;      ///< Velocity over ground along body axes [m/s]; the DVL is at the body's origin.
  static const EgoSensorType depth;    ///< Height, i.e. world z [m]; negative under water.
  static const EgoSensorType gps;      ///< Position in the world [m].
  static const EgoSensorType heading;  ///< Orientation in the world [rad]; unknown axes have a large sigma.

 private:
  const EgoSensorTraits* traits_;
};

/// Returns the table of all types that a scenario may name.
std::span<const EgoSensorTraits> ego_sensor_types();
/// Returns "dvl", "depth", "gps" or "heading".
inline std::string_view name(EgoSensorType type) { return type->name; }
/// Returns the number of residual rows, which is the number of standard deviations.
inline int rows(EgoSensorType type) { return type->reading == EgoReading::world_height ? 1 : 3; }

/// One measurement of the chaser's own sensors. The type of the sensor determines which field is used.
struct EgoMeasurement {
  double t = 0;                         ///< time stamp [s]
  Vector<3> value = Vector<3>::Zero();  ///< vector; a height uses only z
  SO3 rotation{};                       ///< orientation
};

/// A sensor of the chaser, other than the IMU.
struct EgoSensor {
  std::string name;
  EgoSensorType type = EgoSensorType::dvl;
  Eigen::VectorXd sigma{};                     ///< one per residual row [m/s, m, rad]; heading: about body x y z
  SE3 mount{};                                 ///< sensor in the body; only the part that EgoMounting names is used
  double delay = 0;                            ///< s; a measurement stamped t was valid at t − delay
  std::optional<Loss> loss{};                  ///< replaces that of EgoOptions
  std::vector<double> missing{};               ///< numbers in files and streams that stand for missing data
  std::vector<EgoMeasurement> measurements{};  ///< in time order
  std::optional<SystematicError> error{};      ///< systematic errors to estimate

  double valid_at(const EgoMeasurement& m) const { return m.t - delay; }  ///< time of validity [s]
};

/// Data of the chaser's own sensors, in ENU-FLU axes. It needs an IMU, or a heading sensor with a DVL or GPS.
struct NavigationData {
  Earth earth{};
  std::optional<ImuSensor> imu{};
  std::vector<EgoSensor> sensors{};
  double keyframe_interval = 1.0;  ///< maximum time between keyframes [s]
};

}  // namespace tandem
