#pragma once

#include <tandem/lie/operations.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/residuals/log_curvature.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Motion of a body by the mean of its twists at two instants [units of the group's tangent, m and rad on poses]:
///
///   e = Log((X0 Exp(dt (ξ0 + ξ1)/2))⁻¹ X1),   ξ = [ν; ω] over ground, along the body axes
///
/// This is the trapezoidal rule on the group, of second order in dt. As a hard equality it gives the kinematics of a
/// plan. States: X0, ξ0, X1, ξ1. Source: Iserles et al. 2000, "Lie-group methods", §4 (Magnus series, first term).
template <LieGroup G>
struct TwistKinematics {
  static constexpr std::string_view name = "twist kinematics";
  static constexpr int dim = G::dof;
  using Twist = Rn<G::dof>;
  using States = std::tuple<G, Twist, G, Twist>;

  double dt;  ///< t1 − t0 [s], > 0

  auto fields() { return std::tie(dt); }

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

  /// Computes the Hessian from perturbations x0 of X0, δd of d = dt (ξ0 + ξ1)/2 and x1 of X1. With E = X0⁻¹ X1, e =
  /// Log(Exp(−d) E Exp(Ad(E⁻¹) b) Exp(−Ad(E⁻¹) x0) Exp(x1)), where b = −Jr(−d) δd plus second-order terms.
  void curvature(const G& x0, const Twist& w0, const G& x1, const Twist& w1, const Vector<dim>& w,
                 Matrix<4 * G::dof, 4 * G::dof>& H) const requires HasExpCurvature<G> {
    using Tangent = typename G::Tangent;
    using Jacobian = typename G::Jacobian;
    constexpr int n = G::dof;
    const double half = 0.5 * dt;
    const Tangent d = half * (w0.vector() + w1.vector());
    const G E = x0.inverse() * x1;
    const Tangent e = (G::Exp(-d) * E).Log();
    const Jacobian right = G::Jr_inverse(e), moved = E.inverse().Ad();
    const Tangent lambda = right.transpose() * w;
    // by_d: derivative of Ad(E⁻¹) b with respect to each twist. Jx0, Jd: Jacobians of e with respect to X0 and each
    // twist.
    const Jacobian by_d = -half * multiply<G>(moved, G::Jr(-d));
    const Jacobian Jx0 = -multiply<G>(right, moved), Jd = multiply<G>(right, by_d);
    const detail::LogCurvature<G> log(e, lambda);
    const Jacobian bracket = 0.5 * ExpCurvature<G>::bracket(lambda);
    const Jacobian turned = bracket * moved;
    Jacobian of_d = log(Jd, Jd);
    of_d += half * half * ExpCurvature<G>::hessian(-d, Tangent(moved.transpose() * lambda));
    const Jacobian d_x0 = log(Jd, Jx0) - by_d.transpose() * turned;
    const Jacobian d_x1 = log(Jd, right) + by_d.transpose() * bracket;
    const Jacobian x0_x1 = log(Jx0, right) - moved.transpose() * bracket;
    const auto put = [&](int row, int column, const Jacobian& block) {
      H.template block<n, n>(n * row, n * column) = block;
      if (row != column) H.template block<n, n>(n * column, n * row) = block.transpose();
    };
    put(0, 0, log(Jx0, Jx0));
    put(0, 2, x0_x1);
    put(2, 2, log(right, right));
    for (const int twist : {1, 3}) {
      put(twist, 0, d_x0);
      put(twist, 2, d_x1);
      put(twist, twist, of_d);
    }
    put(1, 3, of_d);
  }
};

}  // namespace tandem
