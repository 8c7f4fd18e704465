#pragma once

#include <tandem/lie/operations.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// A body moves by the mean of its twists at two instants [units of the group's tangent, m and rad on poses]:
///
///   e = Log((X0 Exp(dt (ξ0 + ξ1)/2))⁻¹ X1),   ξ = [ν; ω] along the body's axes, over the ground
///
/// States: X0, ξ0, X1, ξ1. The trapezoidal rule on the group, of second order in dt; as a hard equality it is the
/// kinematics of a plan. Source: Iserles et al. 2000, "Lie-group methods", §4 (Magnus series, first term).
template <LieGroup G>
struct TwistKinematics {
  static constexpr std::string_view name = "twist kinematics";
  static constexpr int dim = G::dof;
  using Twist = Rn<G::dof>;
  using States = std::tuple<G, Twist, G, Twist>;

  double dt;  ///< t1 − t0 [s], > 0

  template <Over<G> X, Over<Twist> W>
  void operator()(const X& x0, const W& w0, const X& x1, const W& w1, Rows<dim, X>& r, RowsBy<dim, X>* Jx0 = nullptr,
                  RowsBy<dim, W>* Jw0 = nullptr, RowsBy<dim, X>* Jx1 = nullptr, RowsBy<dim, W>* Jw1 = nullptr) const {
    using S = typename X::Scalar;
    const S half(0.5 * dt);
    const typename X::Tangent d = half * (w0.vector() + w1.vector());
    const X back = X::Exp(-d);
    r = (back * x0.inverse() * x1).Log();
    if (!Jx0 && !Jw0 && !Jx1 && !Jw1) return;
    const InverseJacobians<X> at_r(r);
    if (Jx0) *Jx0 = -multiply<X>(at_r.left, back.Ad());
    if (Jx1) *Jx1 = at_r.right;
    if (Jw0 || Jw1) {
      const typename X::Jacobian by_twist = -half * multiply<X>(at_r.left, X::Jr(d));
      if (Jw0) *Jw0 = by_twist;
      if (Jw1) *Jw1 = by_twist;
    }
  }
};

}  // namespace tandem
