#pragma once

#include <tandem/lie/so3.hpp>

namespace tandem {

/// What a Doppler log read, to be summed up by DvlPreintegrator.
struct DvlReading {
  Vector<3> velocity;                   ///< over ground, along the body's axes [m/s]
  Vector<3> sigma = Vector<3>::Zero();  ///< its standard deviations [m/s]
  double held = 0;                      ///< s that it holds in all, in this sum and in others; 0: in this one alone
};

/// Sums a Doppler log's velocities into PreintegratedDvl's displacement. A velocity holds, along the body's axes, until
/// the next one, the last to the keyframe's time, while a gyroscope says how the body turns: each step is exact for a
/// velocity and a rate that are constant in it,  Δp̃ += ΔR̃ Jl(ω dt) v dt,  ΔR̃ ← ΔR̃ Exp(ω dt).
///
/// Its covariance has two parts. Errors of the readings are independent, and one that holds for T moves the sum by A n,
/// A = Σ ΔR̃ Jl(ω dt) dt over its steps (T I where nothing turns):  Σ A Σ_v Aᵀ. A reading that holds for T but for τ only in
/// this sum counts as white noise over T here and in the sums next to it,  (T/τ) A Σ_v Aᵀ: these then may count as
/// independent, and their total has the covariance that the one reading gives it (exactly where nothing turns between
/// the parts, else not less). The gyroscope's white noise is held over a step, as in ImuPreintegrator; what it does
/// within the step is to first order.
class DvlPreintegrator {
 public:
  /// `reading` holds from the keyframe on; `gyroscope`: root spectral density of its noise [rad/s /√Hz].
  explicit DvlPreintegrator(const DvlReading& reading, double gyroscope = 0)
      : reading_(reading), gyroscope_(gyroscope) {}

  /// The log reads this from now on.
  void measure(const DvlReading& reading);

  /// dt [s] go by while the body turns at this rate, along its own axes and free of bias [rad/s].
  void advance(const Vector<3>& angular_rate, double dt);

  const Vector<3>& displacement() const { return displacement_; }  ///< m, along the body's axes at the start
  const SO3& rotation() const { return R_; }                       ///< since the start
  double dt() const { return dt_; }                                ///< s since the start
  /// Of the displacement [m²].
  Matrix<3, 3> covariance() const;

 private:
  Matrix<3, 3> of_reading() const;
  void add_gyroscope_noise(const Matrix<3, 3>& R, const Matrix<3, 3>& mean, const Vector<3>& step, double dt);

  DvlReading reading_;
  double gyroscope_;
  Vector<3> displacement_ = Vector<3>::Zero();
  SO3 R_{};
  double dt_ = 0.0, since_ = 0.0;                                               // since the reading
  Matrix<3, 3> by_reading_ = Matrix<3, 3>::Zero(), by_readings_ = by_reading_;  // A of this one; past ones' sum
  Matrix<6, 6> by_gyroscope_ = Matrix<6, 6>::Zero();  // of [displacement; rotation], along the axes at the start
};

}  // namespace tandem
