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

/// Sums up the samples between two keyframes. Each interval is integrated exactly for a specific force and an angular
/// rate that are constant in it, along the axes of the sensor. The sensor's lever arm l counts by the centripetal and
/// tangential terms,
///
///   f_body = R_bs f − α × l − ω × (ω × l)
///
/// Source: Forster et al. 2017, "On-Manifold Preintegration for Real-Time Visual-Inertial Odometry".
class ImuPreintegrator {
 public:
  /// `mount`: sensor in the body. Samples are corrected by `bias` = [accelerometer; gyroscope].
  ImuPreintegrator(const SE3& mount, const ImuNoise& noise, const Vector<6>& bias = Vector<6>::Zero());

  /// Adds dt seconds during which the sensor read this; angular_acceleration [rad/s²] is along its axes too.
  void integrate(const Vector<3>& specific_force, const Vector<3>& angular_rate, double dt,
                 const Vector<3>& angular_acceleration = Vector<3>::Zero());
  /// Adds the interval between two samples, by their means; the angular acceleration is their difference over time.
  void integrate(const ImuSample& from, const ImuSample& to);

  const ImuDelta& delta() const { return delta_; }
  /// Of PreintegratedImu's rows.
  const Matrix<15, 15>& covariance() const { return covariance_; }

 private:
  SE3 mount_;
  ImuNoise noise_;
  ImuDelta delta_;
  Matrix<15, 15> covariance_ = Matrix<15, 15>::Zero();
};

}  // namespace tandem
