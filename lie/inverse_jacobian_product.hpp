#pragma once

#include <array>

#include <tandem/lie/bundle.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>

namespace tandem {

/// The coefficient D(x) = 1/θ² − cot(θ/2) / (2θ) of AngleCoefficients as a function of x = θ², with its first and
/// second derivatives. Valid below the first pole, x = 4π².
///
/// The partial fractions of the cotangent give D = 2 Σ_k 1/(4k²π² − x), k ≥ 1. Up to x = 10 (just above θ = π) the
/// first term is evaluated exactly and the others as a Taylor series with coefficients 2 (ζ(2n+2) − 1) / (4π²)^(n+1).
/// All terms are positive, so nothing cancels; the truncation error is below 1e-16. For larger x the derivatives follow
/// from the differential equation 2x D' = 1/4 − 3D + x D².
template <class S>
struct InverseCoefficient {
  S value, first, second;

  explicit InverseCoefficient(const S& x) {
    if (x < 10.) {
      const S pole = 1. / (39.4784176043574345 - x);
      value = first = second = S(0.);
      for (auto c = series.rbegin(); c != series.rend(); ++c) {  // Horner's rule; `second` holds D''/2 until the end
        second = first + x * second;
        first = value + x * first;
        value = *c + x * value;
      }
      value += 2. * pole;
      first += 2. * pole * pole;
      second = 2. * second + 4. * pole * pole * pole;
    } else {
      value = AngleCoefficients<S>(x).D;
      first = (0.25 - 3. * value + x * value * value) / (2. * x);
      second = (value * value + 2. * x * value * first - 5. * first) / (2. * x);
    }
  }

 private:
  static constexpr std::array<double, 15> series{
      0.0326727415121644476,   0.00010564110705334699,  5.6373702828768453e-7,   3.35714192665745136e-9,
      2.07428729041660455e-11, 1.3000482138698974e-13,  8.1960520556910086e-16,  5.18011819616972432e-18,
      3.27753917470179184e-20, 2.07474018785936045e-22, 1.31362418071665338e-24, 8.31800319518926409e-27,
      5.26726299683423087e-29, 3.33548429882214433e-31, 2.11220633231838855e-33,
  };
};

namespace detail {

/// Number of rows at the end of a tangent that are its rotation.
template <class G>
inline constexpr int rotation_rows = -1;
template <int N, class S>
inline constexpr int rotation_rows<BasicRn<N, S>> = 0;
template <class S>
inline constexpr int rotation_rows<BasicSO2<S>> = 0;  // commutative, so Jr = I
template <class S>
inline constexpr int rotation_rows<BasicSE2<S>> = 1;
template <class S>
inline constexpr int rotation_rows<BasicSO3<S>> = 3;
template <int K, class S>
inline constexpr int rotation_rows<BasicSEK3<K, S>> = 3;

}  // namespace detail

/// Returns Jr⁻¹(v) w. Fills `Jv` and `Jw` with the exact derivatives with respect to v and w (`Jw` = Jr⁻¹(v)) if they
/// are not null.
///
/// With A = ad(v), Jr⁻¹(v) = A / (1 − exp(−A)). In each supported group A has the eigenvalues 0 and ±iθ, the latter at
/// most double, so A (A² + θ²)² = 0. Hermite interpolation at the eigenvalues therefore gives a polynomial, with D(x)
/// and x = θ²:
///
///   Jr⁻¹(v) = I + A/2 + a A² + b A⁴,  a = D − x D',  b = −D';   da/dx = −x D'',  db/dx = −D''
///
/// The derivative of the powers of A follows from the product rule and dA w = −ad(w) dv. Its terms have the block
/// structure that the group's `product` expects.
template <LieGroup G>
typename G::Tangent Jr_inverse_times(const typename G::Tangent& v, const typename G::Tangent& w,
                                     typename G::Jacobian* Jv = nullptr, typename G::Jacobian* Jw = nullptr) {
  using S = typename G::Scalar;
  using Tangent = typename G::Tangent;
  using Jacobian = typename G::Jacobian;
  if constexpr (requires { typename G::Parts; }) {
    Tangent product;
    if (Jv) Jv->setZero();
    if (Jw) Jw->setZero();
    detail::static_for<G::size>([&]<int I>() {
      using Part = typename G::template Part<I>;
      constexpr int n = Part::dof, o = G::template offset<I>();
      typename Part::Jacobian by_v, by_w;
      product.template segment<n>(o) = Jr_inverse_times<Part>(v.template segment<n>(o), w.template segment<n>(o),
                                                              Jv ? &by_v : nullptr, Jw ? &by_w : nullptr);
      if (Jv) Jv->template block<n, n>(o, o) = by_v;
      if (Jw) Jw->template block<n, n>(o, o) = by_w;
    });
    return product;
  } else if constexpr (detail::rotation_rows<G> == 0) {
    if (Jv) Jv->setZero();
    if (Jw) Jw->setIdentity();
    return w;
  } else {
    constexpr int turn = detail::rotation_rows<G>;
    static_assert(turn > 0, "Jr_inverse_times supports only Tandem's groups and their bundles");
    const Vector<turn, S> theta = v.template tail<turn>();
    const S x = theta.squaredNorm();
    const InverseCoefficient<S> D(x);
    const S a = D.value - x * D.first, b = -D.first;
    const Jacobian A = G::ad(v);
    const Tangent w1 = A * w, w2 = A * w1, w3 = A * w2, w4 = A * w3;
    if (Jv) {
      const Jacobian B0 = G::ad(w), B1 = G::ad(w1) + multiply<G>(A, B0), B2 = G::ad(w2) + multiply<G>(A, B1),
                     B3 = G::ad(w3) + multiply<G>(A, B2);  // −Bk: the derivative of A^(k+1) w
      *Jv = -0.5 * B0 - a * B1 - b * B3;
      Jv->template rightCols<turn>() -= (2. * D.second * (x * w2 + w4)) * theta.transpose();
    }
    if (Jw) *Jw = G::Jr_inverse(v);
    return w + 0.5 * w1 + a * w2 + b * w4;
  }
}

}  // namespace tandem
