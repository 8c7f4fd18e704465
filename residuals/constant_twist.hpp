#pragma once

#include <tandem/lie/operations.hpp>
#include <tandem/residuals/log_curvature.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Constant body-frame twist over three consecutive states [units of the group's tangent, e.g. m and rad].
///
///   δ1 = T1 ⊖ T0,  δ2 = (dt2/dt1) δ1,  e = T2 ⊖ (T1 ⊕ δ2);   noise: Σ = dt2 Σ̄
///
/// On R^n this is constant velocity. Source: Baxter & Teran Espinoza 2025, eqs. 4-8, Jacobians eqs. 29-31.
template <LieGroup G>
struct ConstantTwist {
  static constexpr std::string_view name = "constant twist";
  static constexpr int dim = G::dof;
  using States = std::tuple<G, G, G>;

  double dt1, dt2;  ///< t1 − t0 and t2 − t1 [s], both > 0

  template <Over<G> X>
  void operator()(const X& t0, const X& t1, const X& t2, Rows<dim, X>& r, RowsBy<dim, X>* J0 = nullptr,
                  RowsBy<dim, X>* J1 = nullptr, RowsBy<dim, X>* J2 = nullptr) const {
    using S = typename X::Scalar;
    const S alpha = S(dt2 / dt1);
    const typename X::Tangent d1 = (t0.inverse() * t1).Log(), d2 = alpha * d1;
    const X back = X::Exp(-d2);
    r = (back * t1.inverse() * t2).Log();
    if (!J0 && !J1 && !J2) return;
    const InverseJacobians<X> at_r(r);
    if (J0 || J1) {  // through T̂2, whose Jacobian is −Jl⁻¹(e)
      const InverseJacobians<X> at_d1(d1);
      const typename X::Jacobian by_d1 = -alpha * multiply<X>(at_r.left, X::Jr(d2));
      if (J0) *J0 = -multiply<X>(by_d1, at_d1.left);
      if (J1) *J1 = multiply<X>(by_d1, at_d1.right) - multiply<X>(at_r.left, back.Ad());  // by δ1, and as the base
    }
    if (J2) *J2 = at_r.right;
  }

  /// With A = T0⁻¹ T1, B = T1⁻¹ T2, v = −δ2: e = Log(Exp(v) B). To first order Exp(v) moves by p and B by z, both in B's
  /// frame; then their product, Exp, Log(A) and the products in A and B have a part each.
  void curvature(const G& t0, const G& t1, const G& t2, const Vector<dim>& w,
                 Matrix<3 * G::dof, 3 * G::dof>& H) const requires HasExpCurvature<G> {
    using Tangent = typename G::Tangent;
    using Jacobian = typename G::Jacobian;
    constexpr int n = G::dof;
    const double alpha = dt2 / dt1;
    const G A = t0.inverse() * t1, B = t1.inverse() * t2;
    const Tangent d1 = A.Log(), v = -alpha * d1, e = (G::Exp(v) * B).Log();
    const InverseJacobians<G> at_d1(d1);
    const Jacobian from_B = B.inverse().Ad(), Jr_v = G::Jr(v), at_e = G::Jr_inverse(e);
    const Jacobian by_d1 = -alpha * multiply<G>(from_B, Jr_v);
    const Jacobian p0 = -multiply<G>(by_d1, at_d1.left), p1 = multiply<G>(by_d1, at_d1.right);
    const Jacobian J0 = multiply<G>(at_e, p0), J1 = multiply<G>(at_e, p1 - from_B);

    // The gradient of φ by the perturbations of the product, of Exp(v), and of A.
    const Tangent of_M = at_e.transpose() * w, of_v = from_B.transpose() * of_M;
    const Tangent of_A = -alpha * (at_d1.right.transpose() * (Jr_v.transpose() * of_v));
    const Jacobian bracket_M = 0.5 * ExpCurvature<G>::bracket(of_M), bracket_A = 0.5 * ExpCurvature<G>::bracket(of_A);
    const detail::LogCurvature<G> log(e, of_M);
    const Jacobian S = alpha * alpha * ExpCurvature<G>::of(v, of_v) - ExpCurvature<G>::of(d1, of_A);
    const Jacobian S_left = S * at_d1.left, S_right = S * at_d1.right;
    const Jacobian z1 = bracket_M * from_B;  // minus what z does to the bracket for T1; for T2 it is bracket_M

    const auto put = [&](int row, int column, const Jacobian& block) {
      H.template block<n, n>(n * row, n * column) = block;
      if (row != column) H.template block<n, n>(n * column, n * row) = block.transpose();
    };
    put(0, 0, log(J0, J0) + at_d1.left.transpose() * S_left);
    put(0, 1,
        log(J0, J1) - at_d1.left.transpose() * S_right - p0.transpose() * z1 -
            A.inverse().Ad().transpose() * bracket_A);
    put(0, 2, log(J0, at_e) + p0.transpose() * bracket_M);
    const Jacobian p1_z1 = p1.transpose() * z1;
    put(1, 1, log(J1, J1) + at_d1.right.transpose() * S_right - p1_z1 - p1_z1.transpose());
    put(1, 2, log(J1, at_e) + p1.transpose() * bracket_M - from_B.transpose() * bracket_M);
    put(2, 2, log(at_e, at_e));
  }
};

}  // namespace tandem
