#pragma once

#include <cmath>

#include <tandem/lie/error.hpp>
#include <tandem/lie/so3.hpp>

namespace tandem {

/// Sums a Doppler log's velocities into PreintegratedDvl's displacement. A velocity holds, along the body's axes, until
/// the next one, the last to the keyframe's time, while a gyroscope says how the body turns: each step is exact for a
/// velocity and a rate that are constant in it,  Δp̃ += ΔR̃ Jl(ω dt) v dt,  ΔR̃ ← ΔR̃ Exp(ω dt).
class DvlPreintegrator {
 public:
  /// `velocity` over ground, along the body's axes [m/s], holds from the keyframe on.
  explicit DvlPreintegrator(const Vector<3>& velocity) : velocity_(velocity) {}

  /// The log reads this from now on [m/s].
  void measure(const Vector<3>& velocity) { velocity_ = velocity; }

  /// dt [s] go by while the body turns at this rate, along its own axes and free of bias [rad/s].
  void advance(const Vector<3>& angular_rate, double dt) {
    if (!(dt >= 0.0) || !std::isfinite(dt)) throw Error("DVL preintegration: dt must be finite and not negative");
    const Vector<3> turn = dt * angular_rate;
    displacement_ += R_.act(SO3::Jl(turn) * velocity_) * dt;
    R_ = R_ * SO3::Exp(turn);
    dt_ += dt;
  }

  const Vector<3>& displacement() const { return displacement_; }  ///< m, along the body's axes at the start
  const SO3& rotation() const { return R_; }                       ///< since the start
  double dt() const { return dt_; }                                ///< s since the start

 private:
  Vector<3> velocity_, displacement_ = Vector<3>::Zero();
  SO3 R_{};
  double dt_ = 0.0;
};

}  // namespace tandem
