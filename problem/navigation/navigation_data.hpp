#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/lie/sek3.hpp>
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
  double max_gap = 0.5;              ///< s without a sample: longer ones split the chain
  double max_specific_force = 0;     ///< m/s², |axis| at or above which a sample is saturated; 0: no limit known
  double max_angular_rate = 0;       ///< rad/s, likewise
  std::vector<ImuSample> samples{};  ///< in time order

  double accelerometer_bias_spread() const {
    return initial_accelerometer_bias.value_or(std::min(100 * noise.accelerometer, 0.5));
  }
  double gyroscope_bias_spread() const {
    return initial_gyroscope_bias.value_or(std::min(1000 * noise.gyroscope, 0.1));
  }
};

/// What the chaser's other sensors measure of itself.
enum class EgoSensorType {
  dvl,      ///< velocity over ground along body axes [m/s]; the body frame is the DVL's
  depth,    ///< height: world z, up, so that depths are negative [m]
  gps,      ///< world x y z [m]
  heading,  ///< orientation in the world, the axes it does not know relaxed by their sigmas [rad]
};

/// "dvl", "depth", "gps", "heading".
std::string_view name(EgoSensorType type);
/// Standard deviations it needs: 3, of a depth 1.
int rows(EgoSensorType type);

/// One measurement of the chaser by itself; the sensor's type says which field counts.
struct EgoMeasurement {
  double t = 0;                         ///< s, as stamped
  Vector<3> value = Vector<3>::Zero();  ///< dvl, gps; of a depth z alone counts
  SO3 rotation{};                       ///< heading
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
