#pragma once

#include <array>
#include <cmath>

#include <tandem/lie/piecewise.hpp>

namespace tandem {

/// Scalar functions of the rotation angle θ [rad] in Exp, Log and the Jacobians of all groups:
///
///   A = sin θ / θ            B = (1 − cos θ) / θ²       C = (θ − sin θ) / θ³
///   D = 1/θ² − cot(θ/2) / (2θ)                           (inverse Jacobians; finite at π, unlike the textbook form)
///   E = (1/2 − B) / θ²       F = (3C − B) / (2θ²)       (Barfoot's Q, 2017, eq. 7.86)
///
/// They are smooth functions of θ². Taylor polynomials are used below `kSeriesBelow` (truncation error below 5e-17),
/// closed forms in the half angle above it. Cancellation in the closed forms costs a few units in the last place of the
/// products that use them.
template <class S>
struct AngleCoefficients {
  static constexpr double kSeriesBelow = 0.25;  // θ² [rad²], θ = 0.5

  S A, B, C, D, E, F;

  // Always inlined, so that the compiler drops the coefficients that a caller does not use.
  [[gnu::always_inline]] explicit AngleCoefficients(const S& theta2) {
    const auto series = [&]() -> std::array<S, 6> {
      const S& x = theta2;
      // clang-format off
      return {
          1. + x*(-1./6 + x*(1./120 + x*(-1./5040 + x*(1./362880 + x*(-1./39916800 + x*(1./6227020800.)))))),
          1./2 + x*(-1./24 + x*(1./720 + x*(-1./40320 + x*(1./3628800 + x*(-1./479001600 + x*(1./87178291200.)))))),
          1./6 + x*(-1./120 + x*(1./5040 + x*(-1./362880 + x*(1./39916800 + x*(-1./6227020800.))))),
          1./12 + x*(1./720 + x*(1./30240 + x*(1./1209600 + x*(1./47900160 + x*(691./1307674368000. +
          x*(1./74724249600.)))))),
          1./24 + x*(-1./720 + x*(1./40320 + x*(-1./3628800 + x*(1./479001600 + x*(-1./87178291200.))))),
          1./120 + x*(-1./2520 + x*(1./120960 + x*(-1./9979200 + x*(1./1245404160 + x*(-1./217945728000.)))))};
      // clang-format on
    };
    const auto closed = [&]() -> std::array<S, 6> {
      using std::cos, std::sin, std::sqrt;
      const S theta = sqrt(theta2);
      const S s = sin(0.5 * theta), c = cos(0.5 * theta);
      const S a = 2. * s * c / theta, b = 2. * s * s / theta2, k = (1. - a) / theta2;
      return {a, b, k, (1. - 0.5 * theta * c / s) / theta2, (0.5 - b) / theta2, (3. * k - b) / (2. * theta2)};
    };
    const std::array<S, 6> all = detail::piecewise(theta2, kSeriesBelow, series, closed);
    A = all[0], B = all[1], C = all[2], D = all[3], E = all[4], F = all[5];
  }
};

}  // namespace tandem
