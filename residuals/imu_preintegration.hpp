#pragma once

#include <tandem/residuals/imu_delta.hpp>

namespace tandem {

/// What an inertial sensor read, along its own axes.
struct ImuSample {
  double t;                  ///< s
  Vector<3> specific_force;  ///< m/s²: at rest, upwards, of the size of gravity
  Vector<3> angular_rate;    ///< rad/s
};

/// Noise of an inertial sensor: root spectral densities of the white noise, and of the biases' random walks.
struct ImuNoise {
  double accelerometer = 0;            ///< m/s² /√Hz
  double gyroscope = 0;                ///< rad/s /√Hz
  double accelerometer_bias_walk = 0;  ///< m/s³ /√Hz
  double gyroscope_bias_walk = 0;      ///< rad/s² /√Hz
  double integration = 0;  ///< m/s /√Hz: of the position beyond what the accelerometer's noise makes of it
};

/// The axes along which the specific force stays constant for an interval: the body's as they turn, which suits means
/// over the interval and makes it exact for a steady turn; or those it has at the start of the interval, which suits
/// samples taken there and is what GTSAM's preintegration does. The two part by ω × f dt²/2 an interval.
enum class ImuHold { turning, at_start };

/// Sums up the samples between two keyframes. Each interval is integrated exactly for a specific force and an angular
/// rate of the body that are constant in it (see ImuHold). The sensor's lever arm l counts by the centripetal and
/// tangential terms,
///
///   ω_body = R_bs ω      f_body = R_bs f − α × l − ω_body × (ω_body × l)
///
/// which bias Jacobians attend to, but not the covariance: what the gyroscope's noise does through them is of the size
/// of the velocity l σ_g/√dt, next to (t |f| σ_g + σ_a) √t of the rest. White noise and bias hold over an interval.
/// Source: Forster et al. 2017, "On-Manifold Preintegration for Real-Time Visual-Inertial Odometry".
class ImuPreintegrator {
 public:
  /// `mount`: sensor in the body. Samples are corrected by `bias` = [accelerometer; gyroscope] [m/s², rad/s].
  ImuPreintegrator(const SE3& mount, const ImuNoise& noise, const Vector<6>& bias = Vector<6>::Zero(),
                   ImuHold hold = ImuHold::turning);

  /// Adds dt seconds during which the sensor read this; angular_acceleration [rad/s²] is along its axes too. Throws
  /// Error when dt is negative or not finite.
  void integrate(const Vector<3>& specific_force, const Vector<3>& angular_rate, double dt,
                 const Vector<3>& angular_acceleration = Vector<3>::Zero());
  /// Adds the interval between two samples, by their means; the angular acceleration is their difference over time.
  void integrate(const ImuSample& from, const ImuSample& to);

  const ImuDelta& delta() const { return delta_; }
  /// Of PreintegratedImu's rows: position, velocity and rotation along the body's axes at the end, biases along the
  /// sensor's. The biases' walk since the start is in them, and what it did to the other rows.
  Matrix<15, 15> covariance() const;

 private:
  using ByBias = Matrix<9, 6>;
  void add_noise(const Vector<3>& moved, const Vector<3>& gained, const ByBias& G, double dt);

  Matrix<3, 3> R_bs_;
  Vector<3> lever_;
  ImuNoise noise_;
  ImuHold hold_;
  ImuDelta delta_;
  // Of [position; velocity; rotation] along the body's axes at the start, where errors are carried on by shears alone.
  ByBias by_sensor_ = ByBias::Zero();  ///< by errors of all samples alike: minus the Jacobian by the biases
  Matrix<9, 9> covariance_ = Matrix<9, 9>::Zero();
  ByBias with_sensor_ = ByBias::Zero();  ///< minus the covariance with the biases' walk
};

}  // namespace tandem
