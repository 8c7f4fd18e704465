#pragma once

#include <cmath>

namespace tandem {

/// A component u of a velocity that is forgotten with a time constant τ while white noise disturbs it:
///   du = −u dt/τ + σ dW,   with t ≥ 0 s:   E u(t) = φ(t) u(0),   Var u(t) = σ² v(t)  given u(0).
/// τ = ∞ is a random walk. Source: Uhlenbeck & Ornstein 1930; Gelb 1974, Applied Optimal Estimation, §2.2.
struct OrnsteinUhlenbeck {
  double time_constant;  ///< τ [s], > 0; may be infinite

  /// φ = exp(−t/τ), what is left of u.
  double kept(double t) const { return std::exp(-t / time_constant); }
  /// v = τ/2 (1 − exp(−2t/τ)) [s], ∫ exp(−2s/τ) ds: of the noise, what has not been forgotten.
  double gathered(double t) const {
    return std::isinf(time_constant) ? t : -0.5 * time_constant * std::expm1(-2 * t / time_constant);
  }
};

}  // namespace tandem
