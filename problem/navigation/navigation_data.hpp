#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/lie/sek3.hpp>
#include <tandem/problem/navigation/staying_error.hpp>
#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/residuals/earth.hpp>
#include <tandem/residuals/imu_preintegration.hpp>
#include <tandem/residuals/loss.hpp>

namespace tandem {

/// The chaser's own inertial sensor.
struct ImuSensor {
  std::string name = "imu";
  SE3 mount{};  ///< sensor in the body
  ImuNoise noise{};
  /// σ of what is not known of the biases at the start, m/s² and rad/s. Where nothing is said, by the grade that the
  /// noise shows: a hundred and a thousand s^½ times that, at most 0.5 m/s² and 0.1 rad/s.
  std::optional<double> initial_accelerometer_bias{}, initial_gyroscope_bias{};
  double max_gap = 0.5;           ///< s without a sample: longer ones split the chain
  double max_specific_force = 0;  ///< m/s², |axis| at or above which a sample is saturated; 0: no limit known
  double max_angular_rate = 0;    ///< rad/s, likewise
  /// s that stamps were late by, and that the times below are without already. Below zero where stamps are early: by half
  /// a sample where a line is the mean over the interval that follows its stamp.
  double delay = 0;
  std::vector<ImuSample> samples{};  ///< in time order

  /// Moves the samples to when they were valid by this delay.
  void set_delay(double seconds) {
    for (ImuSample& sample : samples) sample.t += delay - seconds;
    delay = seconds;
  }

  double accelerometer_bias_spread() const {
    return initial_accelerometer_bias.value_or(std::min(100 * noise.accelerometer, 0.5));
  }
  double gyroscope_bias_spread() const {
    return initial_gyroscope_bias.value_or(std::min(1000 * noise.gyroscope, 0.1));
  }
};

struct Block;
struct EgoMeasurement;
struct EgoSensor;
namespace detail {
struct EgoPlacing;
}

/// The numbers of a reading: which field of EgoMeasurement holds them, and how the axes of a file turn them.
enum class EgoReading {
  body_vector,   ///< value, along the body's axes
  world_vector,  ///< value, along the world's axes
  world_height,  ///< value.z(), up
  orientation,   ///< rotation, of the sensor in the world
};

/// What a scenario may say of where such a sensor is in the body.
enum class EgoMounting { none, position, orientation };

/// All that is said of one kind of the chaser's sensors outside of its residual: reading files and live lines, checks,
/// simulation and the builders go by this. Its rows are a table in navigation_data.cpp.
struct EgoSensorTraits {
  std::string_view name;     ///< in scenario.yaml and messages
  std::string_view columns;  ///< of its rows, t [s] first
  EgoReading reading;
  EgoMounting mounting;
  /// Readings above `most` in size are no reading of such a sensor: "NAME: it measures" 1500 "m/s, …".
  double most;
  std::string_view measures, doubt;
  bool may_stay;  ///< whether a working sensor may read one value for seconds
  /// What it reads at an instant, exactly, from the body's pose and its velocity in the world [m/s].
  EgoMeasurement (*ideal)(const EgoSensor& sensor, double t, const SE3& pose, const Vector<3>& velocity);
  /// Adds a measurement to a problem: its placement (see ego_placing.hpp).
  Block (*place)(const detail::EgoPlacing& at, const EgoMeasurement& m);
};

/// The kind of a sensor: a handle of one row of traits, of the table or of one's own (which has to outlive it).
class EgoSensorType {
 public:
  constexpr EgoSensorType(const EgoSensorTraits& traits) : traits_(&traits) {}
  constexpr const EgoSensorTraits* operator->() const { return traits_; }
  constexpr const EgoSensorTraits& traits() const { return *traits_; }
  friend constexpr bool operator==(EgoSensorType, EgoSensorType) = default;

  static const EgoSensorType dvl;      ///< velocity over ground along body axes [m/s]; the body frame is the DVL's
  static const EgoSensorType depth;    ///< height: world z, up, so that depths are negative [m]
  static const EgoSensorType gps;      ///< world x y z [m]
  static const EgoSensorType heading;  ///< orientation in the world, unknown axes relaxed by their sigmas [rad]

 private:
  const EgoSensorTraits* traits_;
};

/// The table: all kinds that a scenario may name.
std::span<const EgoSensorTraits> ego_sensor_types();
/// "dvl", "depth", "gps", "heading".
inline std::string_view name(EgoSensorType type) { return type->name; }
/// Standard deviations it needs: 3, of a height 1.
inline int rows(EgoSensorType type) { return type->reading == EgoReading::world_height ? 1 : 3; }

/// One measurement of the chaser by itself; the sensor's type says which field counts.
struct EgoMeasurement {
  double t = 0;                         ///< s, as stamped
  Vector<3> value = Vector<3>::Zero();  ///< a vector, or a height: then z alone counts
  SO3 rotation{};                       ///< an orientation
};

/// A sensor of the chaser's own other than the inertial one.
struct EgoSensor {
  std::string name;
  EgoSensorType type = EgoSensorType::dvl;
  Eigen::VectorXd sigma{};                     ///< one a row [m/s, m, rad]; heading: about the body's x y z
  SE3 mount{};                                 ///< sensor in the body: where depth and gps sit, how heading is turned
  double delay = 0;                            ///< s: a measurement stamped t was valid at t − delay
  std::optional<Loss> loss{};                  ///< in place of the problem's
  std::vector<EgoMeasurement> measurements{};  ///< in time order
  std::optional<StayingError> error{};         ///< beside its noise

  double valid_at(const EgoMeasurement& m) const { return m.t - delay; }  ///< s
};

/// What the chaser knows of itself by its own sensors: the inertial one, or a DVL with a heading, is needed, all else
/// is optional. Files, simulators and live feeds all end here; all in ENU-FLU.
struct NavigationData {
  Earth earth{};
  std::optional<ImuSensor> imu{};
  std::vector<EgoSensor> sensors{};
  double keyframe_interval = 1.0;  ///< s
};

}  // namespace tandem
