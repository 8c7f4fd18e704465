#pragma once

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Constant velocity of the positions of three consecutive states, each a pose or a point (SE3, R3; or SE2, R2) [m]:
///
///   e = p2 − p1 − (dt2/dt1) (p1 − p0),  p = t(X);   noise: Σ = dt2 Σ̄
///
/// ConstantTwist on R^n where all three are points.
/// Source: Baxter & Teran Espinoza 2025, §V-A, eqs. 9-14 (Mode B).
template <LieGroup A, LieGroup B, LieGroup C>
requires(A::point_dim == B::point_dim && B::point_dim == C::point_dim) struct MixedConstantVelocity {
  static constexpr std::string_view name = "mixed constant velocity";
  static constexpr int dim = A::point_dim;
  using States = std::tuple<A, B, C>;

  double dt1, dt2;  ///< t1 − t0 and t2 − t1 [s], both > 0

  template <Over<A> X0, Over<B> X1, Over<C> X2>
  void operator()(const X0& x0, const X1& x1, const X2& x2, Rows<dim, X0>& r, RowsBy<dim, X0>* J0 = nullptr,
                  RowsBy<dim, X1>* J1 = nullptr, RowsBy<dim, X2>* J2 = nullptr) const {
    using S = typename X0::Scalar;
    const S alpha(dt2 / dt1);
    const Vector<dim, S> origin = Vector<dim, S>::Zero();
    r = x2.translation() - x1.translation() - alpha * (x1.translation() - x0.translation());
    if (J0) *J0 = alpha * x0.act_jacobian(origin);
    if (J1) *J1 = -(S(1.) + alpha) * x1.act_jacobian(origin);
    if (J2) *J2 = x2.act_jacobian(origin);
  }
};

}  // namespace tandem
