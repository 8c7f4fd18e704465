#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include <tandem/lie/error.hpp>

namespace tandem {

/// Robust loss ρ(s) of the squared whitened norm s = rᵀ Σ⁻¹ r; the cost of a residual is ½ ρ(s). All losses have ρ(0) =
/// 0 and ρ'(0) = 1. Loss is a value type, not a class hierarchy, because a predictable branch is faster than a virtual
/// call.
struct Loss {
  enum class Kind { none, huber, cauchy, geman_mcclure, tukey, student_t };

  Kind kind = Kind::none;
  double scale = 1.0;  ///< in standard deviations

  struct Value {
    double rho, d1, d2;  ///< ρ(s), ρ'(s), ρ''(s)
  };

  // Always inlined and thus compiled for the caller's instruction set, so that evaluations with and without derivatives
  // round alike.
  [[gnu::always_inline]] Value operator()(double s) const {
    const double c2 = scale * scale;
    switch (kind) {
      case Kind::none:
        break;
      case Kind::huber: {
        if (s <= c2) break;
        const double r = std::sqrt(s), d1 = scale / r;
        return {2.0 * scale * r - c2, d1, -0.5 * d1 / s};
      }
      case Kind::cauchy:
      case Kind::student_t: {
        const double u = 1.0 / (1.0 + s / c2);
        return {c2 * std::log1p(s / c2), u, -u * u / c2};
      }
      case Kind::geman_mcclure: {
        const double u = c2 / (c2 + s);
        return {s * u, u * u, -2.0 * u * u * u / c2};
      }
      case Kind::tukey: {
        const double x = std::min(s / c2, 1.0), u = 1.0 - x;
        return {c2 * x * (1.0 - x * (1.0 - x / 3.0)), u * u, -2.0 * u / c2};  // c²/3 (1 − u³) without cancellation
      }
    }
    return {s, 1.0, 0.0};
  }

  /// Returns the value of s / scale² below which ρ(r²) is strictly convex in r (ρ' + 2 s ρ'' > 0). Infinite without a
  /// loss.
  double convexity_limit() const {
    switch (kind) {
      case Kind::none:
        break;
      case Kind::huber:  // also convex above, but without curvature along r
      case Kind::cauchy:
      case Kind::student_t:
        return 1.0;
      case Kind::geman_mcclure:
        return 1.0 / 3.0;
      case Kind::tukey:
        return 1.0 / 5.0;
    }
    return HUGE_VAL;
  }
};

namespace detail {

inline double checked_scale(double scale) {
  if (!(scale > 0) || !std::isfinite(scale))
    throw BadInputError("loss: scale " + std::to_string(scale) +
                        " is not positive and finite; it is in standard deviations");
  return scale;
}

}  // namespace detail

// The functions below throw Error if the scale is not positive and finite.

/// Loss that is quadratic up to `scale` standard deviations and linear above (Huber 1964).
inline Loss Huber(double scale) { return {Loss::Kind::huber, detail::checked_scale(scale)}; }
/// Logarithmic loss; reduces the weight of outliers but never rejects them.
inline Loss Cauchy(double scale) { return {Loss::Kind::cauchy, detail::checked_scale(scale)}; }
/// Loss that slowly approaches its bound scale² (Geman & McClure 1985).
inline Loss GemanMcClure(double scale) { return {Loss::Kind::geman_mcclure, detail::checked_scale(scale)}; }
/// Loss bounded by scale²/3. A residual beyond `scale` has no influence (Beaton & Tukey 1974).
inline Loss Tukey(double scale) { return {Loss::Kind::tukey, detail::checked_scale(scale)}; }
/// Negative log-density of Student's t distribution with `dof` degrees of freedom over `rows` rows, times two and up to
/// a constant (Lange, Little & Taylor 1989). It equals Cauchy's loss with the scale √(dof + rows). The Gaussian noise
/// must match the curvature of the density at its peak: its standard deviations are √(dof / (dof + rows)) times the
/// scale of the t distribution. Unlike the other losses it is a model of the noise, and calibration uses its density.
inline Loss StudentT(double dof, int rows) {
  return {Loss::Kind::student_t, std::sqrt(detail::checked_scale(dof) + rows)};
}

}  // namespace tandem
