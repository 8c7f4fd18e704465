#pragma once

#include <cmath>

namespace tandem {

/// Ornstein–Uhlenbeck process: a velocity component u decays with a time constant τ and is disturbed by white noise,
///   du = −u dt/τ + σ dW.   Given u(0):   E u(t) = φ(t) u(0),   Var u(t) = σ² v(t).
/// τ = ∞ is a random walk. Source: Uhlenbeck & Ornstein 1930; Gelb 1974, Applied Optimal Estimation, §2.2.
struct OrnsteinUhlenbeck {
  double time_constant;  ///< τ [s], > 0; may be infinite

  /// Returns φ(t) = exp(−t/τ).
  double decay(double t) const { return std::exp(-t / time_constant); }
  /// Returns v(t) = ∫ exp(−2s/τ) ds = τ/2 (1 − exp(−2t/τ)) [s], the variance of u for σ = 1.
  double unit_variance(double t) const {
    return std::isinf(time_constant) ? t : -0.5 * time_constant * std::expm1(-2 * t / time_constant);
  }
};

}  // namespace tandem
