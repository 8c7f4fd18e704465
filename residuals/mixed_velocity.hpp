#pragma once

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/ornstein_uhlenbeck.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Motion prior on the positions of three consecutive states, each a pose or a point (SE3, R3; or SE2, R2). The
/// velocity is constant or decays along each world axis with its own time constant [m]:
///
///   e = p2 − p1 − φ (dt2/dt1) (p1 − p0),  p = t(X)
///
/// Constant velocity: φ = 1, noise Σ = dt2 Σ̄. Damped velocity: φ and noise as in DampedTwist. If all three states are
/// points, the residual equals ConstantTwist or DampedTwist on R^n. Source: Baxter & Teran Espinoza 2025, §V-A, eqs.
/// 9-14 (Mode B), for the constant velocity.
template <LieGroup A, LieGroup B, LieGroup C>
requires(A::point_dim == B::point_dim && B::point_dim == C::point_dim && requires(const A& a, const B& b, const C& c) {
  a.translation();
  b.translation();
  c.translation();
}) struct MixedVelocity {
  static constexpr std::string_view name = "velocity";
  static constexpr int dim = A::point_dim;
  using States = std::tuple<A, B, C>;

  Vector<dim> gain;  ///< φ dt2/dt1 of each axis

  auto fields() { return std::tie(gain); }

  /// Constructs the constant-velocity prior; dt1 = t1 − t0 and dt2 = t2 − t1 [s], both > 0.
  static MixedVelocity constant(double dt1, double dt2) { return {Vector<dim>::Constant(dt2 / dt1)}; }
  /// Constructs the damped prior from time constants [s], > 0; infinite ones give constant().
  static MixedVelocity damped(double dt1, double dt2, const Vector<dim>& time_constants) {
    const double h = 0.5 * (dt1 + dt2);
    return {time_constants.unaryExpr([=](double tau) { return dt2 / dt1 * OrnsteinUhlenbeck{tau}.decay(h); })};
  }

  template <Over<A> X0, Over<B> X1, Over<C> X2>
  void operator()(const X0& x0, const X1& x1, const X2& x2, Rows<dim, X0>& r, RowsBy<dim, X0>* J0 = nullptr,
                  RowsBy<dim, X1>* J1 = nullptr, RowsBy<dim, X2>* J2 = nullptr) const {
    using S = typename X0::Scalar;
    const Vector<dim, S> by_before = gain.template cast<S>(), by_now = -(Vector<dim, S>::Ones() + by_before);
    const Vector<dim, S> origin = Vector<dim, S>::Zero();
    r = x2.translation() - x1.translation() - by_before.cwiseProduct(x1.translation() - x0.translation());
    if (J0) *J0 = by_before.asDiagonal() * x0.act_jacobian(origin);
    if (J1) *J1 = by_now.asDiagonal() * x1.act_jacobian(origin);
    if (J2) *J2 = x2.act_jacobian(origin);
  }
};

}  // namespace tandem
