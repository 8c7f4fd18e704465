#pragma once

#include <tandem/lie/so3.hpp>

namespace tandem {

/// Reading of a Doppler velocity log (DVL), for DvlPreintegrator.
struct DvlReading {
  Vector<3> velocity;                   ///< over ground, along the body axes [m/s]
  Vector<3> sigma = Vector<3>::Zero();  ///< standard deviations of the velocity [m/s]
  double hold_time = 0;                 ///< total duration of the reading, including other sums [s]; 0: this sum only
};

/// Integrates DVL readings into the displacement of PreintegratedDvl. A reading holds, along the body axes, until the
/// next one; the last one holds until the keyframe. A gyroscope gives the rotation. Each step is exact for a constant
/// velocity and rate:
///
///   Δp̃ += ΔR̃ Jl(ω dt) v dt,  ΔR̃ ← ΔR̃ Exp(ω dt)
///
/// The covariance has two parts. The errors of the readings are independent. A reading with covariance Σ_v adds A Σ_v
/// Aᵀ, where A = Σ ΔR̃ Jl(ω dt) dt over its steps (its duration times I without rotation). If only a part τ of the
/// duration T of a reading lies in this sum, its error is modelled as white noise over T and adds (T/τ) A Σ_v Aᵀ.
/// Adjacent sums may then be treated as independent. The covariance of their total is exact without rotation between
/// the parts, and otherwise conservative. The white noise of the gyroscope is held constant over a step, as in
/// ImuPreintegrator, and its effect within the step is of first order.
class DvlPreintegrator {
 public:
  /// `reading` holds from the keyframe on; `gyroscope` is the root spectral density of the gyroscope noise [rad/s
  /// /√Hz].
  explicit DvlPreintegrator(const DvlReading& reading, double gyroscope = 0)
      : reading_(reading), gyroscope_(gyroscope) {}

  /// Replaces the current reading.
  void measure(const DvlReading& reading);

  /// Integrates the current reading over dt [s], while the body rotates at this bias-free rate along its own axes
  /// [rad/s]. Throws Error if dt is negative or not finite.
  void advance(const Vector<3>& angular_rate, double dt);

  const Vector<3>& displacement() const { return displacement_; }  ///< m, along the body axes at the start
  const SO3& rotation() const { return R_; }                       ///< since the start
  double dt() const { return dt_; }                                ///< s since the start
  /// Returns the covariance of the displacement [m²].
  Matrix<3, 3> covariance() const;

 private:
  Matrix<3, 3> of_reading() const;
  void add_gyroscope_noise(const Matrix<3, 3>& R, const Matrix<3, 3>& mean, const Vector<3>& step, double dt);

  DvlReading reading_;
  double gyroscope_;
  Vector<3> displacement_ = Vector<3>::Zero();
  SO3 R_{};
  double dt_ = 0.0, since_ = 0.0;  // s, since the start and since the reading
  Matrix<3, 3> by_reading_ = Matrix<3, 3>::Zero(), by_readings_ = by_reading_;  // A; sum over past readings
  Matrix<6, 6> by_gyroscope_ = Matrix<6, 6>::Zero();  // covariance of [displacement; rotation], axes at the start
};

}  // namespace tandem
