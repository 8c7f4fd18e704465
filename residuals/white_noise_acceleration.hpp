#pragma once

#include <cmath>

#include <tandem/lie/error.hpp>
#include <tandem/lie/inverse_jacobian_product.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Constant body twist disturbed by white noise on its rate: a Gaussian-process prior on pose and twist ϖ = [ν; ω] at
/// two times (on poses m, rad; m/s, rad/s),
///
///   e = [Log(T0⁻¹ T1) − dt ϖ0;  Jr⁻¹(Log(T0⁻¹ T1)) ϖ1 − ϖ0]
///
/// States: T0, ϖ0, T1, ϖ1. The Jacobians are exact, including the derivative of Jr⁻¹. Source: Anderson & Barfoot 2015,
/// "Full STEAM ahead" (left perturbations); Dong et al. 2018 for right perturbations.
template <LieGroup G>
struct WhiteNoiseAcceleration {
  static constexpr std::string_view name = "white noise on acceleration";
  static constexpr int dim = 2 * G::dof;
  using Twist = Rn<G::dof>;
  using States = std::tuple<G, Twist, G, Twist>;

  double dt;  ///< t1 − t0 [s], > 0

  auto fields() { return std::tie(dt); }

  template <Over<G> X, Over<Twist> W>
  void operator()(const X& t0, const W& w0, const X& t1, const W& w1, Rows<dim, X>& r, RowsBy<dim, X>* Jt0 = nullptr,
                  RowsBy<dim, W>* Jw0 = nullptr, RowsBy<dim, X>* Jt1 = nullptr, RowsBy<dim, W>* Jw1 = nullptr) const {
    using S = typename X::Scalar;
    using Jacobian = typename X::Jacobian;
    constexpr int n = G::dof;
    const typename X::Tangent d = (t0.inverse() * t1).Log();
    Jacobian by_d;
    r << d - S(dt) * w0.vector(), Jr_inverse_times<X>(d, w1.vector(), Jt0 || Jt1 ? &by_d : nullptr) - w0.vector();
    if (Jw0) *Jw0 << S(-dt) * Jacobian::Identity(), -Jacobian::Identity();
    if (!Jt0 && !Jt1 && !Jw1) return;
    const InverseJacobians<X> at_d(d);
    if (Jt0) *Jt0 << -at_d.left, -multiply<X>(by_d, at_d.left);
    if (Jt1) *Jt1 << at_d.right, multiply<X>(by_d, at_d.right);
    if (Jw1) *Jw1 << Matrix<n, n, S>::Zero(), at_d.right;
  }

  /// Returns the covariance [dt³/3 Q, dt²/2 Q; dt²/2 Q, dt Q]. Q is the diagonal matrix of the noise's power spectral
  /// densities on the axes of the twist [m²/s³, rad²/s³]. Throws Error if dt or a density is not positive and finite.
  /// Example:
  ///   Gaussian::covariance(WhiteNoiseAcceleration<SE3>::covariance(densities, dt))
  static Matrix<dim, dim> covariance(const Vector<G::dof>& densities, double dt) {
    constexpr int n = G::dof;
    if (!(dt > 0.0) || !std::isfinite(dt)) throw BadInputError(std::string(name) + ": dt must be positive and finite");
    if (!(densities.array() > 0.0).all() || !densities.allFinite())
      throw BadInputError(std::string(name) + ": spectral densities must be positive and finite");
    const Matrix<n, n> Q = densities.asDiagonal();
    Matrix<dim, dim> sigma;
    sigma << dt * dt * dt / 3.0 * Q, dt * dt / 2.0 * Q, dt * dt / 2.0 * Q, dt * Q;
    return sigma;
  }
};

}  // namespace tandem
