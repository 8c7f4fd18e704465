#pragma once

#include <tandem/residuals/imu_delta.hpp>

namespace tandem {

/// Measurement of an inertial sensor, along its own axes.
struct ImuSample {
  double t;                  ///< s
  Vector<3> specific_force;  ///< m/s²; at rest it points upwards with the magnitude of gravity
  Vector<3> angular_rate;    ///< rad/s
  /// Time since the previous sample if samples between them were discarded as not physical [s], else 0. The motion in
  /// such a gap is interpolated, with an uncertainty that grows with its length.
  double gap = 0;
};

/// Noise of an inertial sensor: root spectral densities of the white noise and of the random walks of the biases.
struct ImuNoise {
  double accelerometer = 0;            ///< m/s² /√Hz
  double gyroscope = 0;                ///< rad/s /√Hz
  double accelerometer_bias_walk = 0;  ///< m/s³ /√Hz
  double gyroscope_bias_walk = 0;      ///< rad/s² /√Hz
  double integration = 0;              ///< m/s /√Hz: additional white noise of the position
};

/// Axes along which the specific force is constant during an interval. `turning`: the axes of the rotating body; for
/// samples that are means over the interval; exact for a steady turn. `at_start`: the axes at the start of the
/// interval; for samples taken there; equals GTSAM's preintegration. The two differ by ω × f dt²/2 for each interval.
enum class ImuHold { turning, at_start };

/// Preintegrates the inertial samples between two keyframes. Each interval is integrated exactly for a constant
/// specific force and angular rate of the body (see ImuHold). The lever arm l of the sensor enters by its centripetal
/// and tangential terms,
///
///   ω_body = R_bs ω      f_body = R_bs f − α × l − ω_body × (ω_body × l)
///
/// The bias Jacobians include these terms. The covariance neglects them: through them the gyroscope noise causes a
/// velocity error of l σ_g/√dt, compared with (t |f| σ_g + σ_a) √t in total. White noise and biases are constant within
/// an interval. Source: Forster et al. 2017, "On-Manifold Preintegration for Real-Time Visual-Inertial Odometry".
class ImuPreintegrator {
 public:
  /// `mount` is the pose of the sensor in the body. Subtracts `bias` = [accelerometer; gyroscope] [m/s², rad/s] from
  /// the samples.
  ImuPreintegrator(const SE3& mount, const ImuNoise& noise, const Vector<6>& bias = Vector<6>::Zero(),
                   ImuHold hold = ImuHold::turning);

  /// Adds an interval of dt seconds with these constant measurements; angular_acceleration [rad/s²] is along the sensor
  /// axes too. Throws Error if dt is negative or not finite.
  void integrate(const Vector<3>& specific_force, const Vector<3>& angular_rate, double dt,
                 const Vector<3>& angular_acceleration = Vector<3>::Zero());
  /// Adds the interval between two samples, with the mean of their measurements. The angular acceleration is the
  /// difference of their rates over time. Within a gap (ImuSample::gap), the noise is that of interpolated samples.
  /// Throws Error unless from.t < to.t.
  void integrate(const ImuSample& from, const ImuSample& to);

  const ImuDelta& delta() const { return delta_; }
  /// Returns the covariance of the rows of PreintegratedImu: position, velocity and rotation along the body axes at the
  /// end, biases along the sensor axes. Includes the random walk of the biases since the start and its effect on the
  /// other rows.
  Matrix<15, 15> covariance() const;

 private:
  using ByBias = Matrix<9, 6>;
  void add_noise(const Vector<3>& moved, const Vector<3>& gained, const ByBias& G, double dt);

  Matrix<3, 3> R_bs_;
  Vector<3> lever_;
  ImuNoise noise_;
  ImuHold hold_;
  ImuDelta delta_;
  // Errors of [position; velocity; rotation] along the body axes at the start. Along these axes, the matrix that
  // propagates errors over a step is unit triangular.
  ByBias by_sensor_error_ = ByBias::Zero();  ///< effect of an error common to all samples: minus the bias Jacobian
  Matrix<9, 9> covariance_ = Matrix<9, 9>::Zero();
  ByBias minus_bias_covariance_ = ByBias::Zero();  ///< minus the cross-covariance with the bias random walk
};

}  // namespace tandem
