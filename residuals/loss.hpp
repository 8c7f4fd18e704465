#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include <tandem/lie/error.hpp>

namespace tandem {

/// Robust loss ρ(s) of the squared whitened norm s = rᵀ Σ⁻¹ r; a residual's cost is ½ ρ(s). Every loss has
/// ρ(0) = 0 and ρ'(0) = 1; `scale` is in standard deviations (dimensionless). A value, not a class hierarchy:
/// evaluation is a predictable branch.
struct Loss {
  enum class Kind { none, huber, cauchy, geman_mcclure, tukey, student_t };

  Kind kind = Kind::none;
  double scale = 1.0;  ///< in standard deviations

  struct Value {
    double rho, d1, d2;  ///< ρ(s), ρ'(s), ρ''(s)
  };

  // Inlined, so that it is compiled for the instructions of what asks: costs alone and with derivatives round alike.
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

  /// s / scale² below which ρ(r²) is strictly convex in r, ρ' + 2 s ρ'' > 0; infinite without a loss.
  double convex_until() const {
    switch (kind) {
      case Kind::none:
        break;
      case Kind::huber:  // convex beyond, too, but with no curvature along r
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
    throw Error("loss: scale " + std::to_string(scale) + " is not positive and finite; it is in standard deviations");
  return scale;
}

}  // namespace detail

// The makers throw Error when the scale is not positive and finite.

/// Quadratic up to `scale` standard deviations, linear beyond (Huber 1964).
inline Loss Huber(double scale) { return {Loss::Kind::huber, detail::checked_scale(scale)}; }
/// Logarithmic; down-weights, never rejects.
inline Loss Cauchy(double scale) { return {Loss::Kind::cauchy, detail::checked_scale(scale)}; }
/// Bounded by scale², reached slowly (Geman & McClure 1985).
inline Loss GemanMcClure(double scale) { return {Loss::Kind::geman_mcclure, detail::checked_scale(scale)}; }
/// Bounded by scale²/3; beyond `scale` a residual has no influence at all (Beaton & Tukey 1974).
inline Loss Tukey(double scale) { return {Loss::Kind::tukey, detail::checked_scale(scale)}; }
/// Minus twice the logarithm of Student's t with `dof` degrees of freedom over so many rows, up to a constant: Cauchy's
/// loss at √(dof + rows), with the noise of the normal distribution that is as curved at the peak, √(dof / (dof + rows))
/// times the t's own scale. It says that noise is so distributed, not that it is normal but for outliers: calibration
/// takes it at its word. Lange, Little & Taylor 1989.
inline Loss StudentT(double dof, int rows) {
  return {Loss::Kind::student_t, std::sqrt(detail::checked_scale(dof) + rows)};
}

}  // namespace tandem
