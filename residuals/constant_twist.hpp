#pragma once

#include <tandem/lie/operations.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/carried_twist_curvature.hpp>
#include <tandem/residuals/residual.hpp>
#include <tandem/residuals/residual_functions.hpp>

namespace tandem {

/// Constant body-frame twist over three consecutive states [units of the group's tangent, e.g. m and rad]:
///
///   δ1 = T1 ⊖ T0,  δ2 = (dt2/dt1) δ1,  e = T2 ⊖ (T1 ⊕ δ2);   noise: Σ = dt2 Σ̄
///
/// On R^n this is constant velocity. Source: Baxter & Teran Espinoza 2025, eqs. 4-8, Jacobians eqs. 29-31.
template <LieGroup G>
struct ConstantTwist {
  static constexpr std::string_view name = "constant twist";
  static constexpr int dim = G::dof;
  using States = std::tuple<G, G, G>;

  typename G::Scalar dt1, dt2;  ///< t1 − t0 and t2 − t1 [s], both > 0

  auto fields() { return std::tie(dt1, dt2); }

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
    if (J0 || J1) {  // chain rule through T̂2 = T1 ⊕ δ2; ∂e/∂T̂2 = −Jl⁻¹(e)
      const InverseJacobians<X> at_d1(d1);
      const typename X::Jacobian by_d1 = -alpha * multiply<X>(at_r.left, X::Jr(d2));
      if (J0) *J0 = -multiply<X>(by_d1, at_d1.left);
      if (J1) *J1 = multiply<X>(by_d1, at_d1.right) - multiply<X>(at_r.left, back.Ad());  // through δ1, and directly
    }
    if (J2) *J2 = at_r.right;
  }

  void curvature(const G& t0, const G& t1, const G& t2, const Rows<dim, G>& w,
                 Matrix<3 * G::dof, 3 * G::dof, typename G::Scalar>& H) const requires HasExpCurvature<G> {
    using Tangent = typename G::Tangent;
    detail::curvature_of_carried_twist<G, true>(t0, t1, t2, Tangent::Constant(dt2 / dt1), Tangent::Zero(), w, H);
  }
};

// Instantiated in constant_twist.cpp.
namespace detail {
extern template struct FunctionsOf<ConstantTwist<SE3>>;
extern template struct FunctionsOf<ConstantTwist<SE2>>;
}  // namespace detail

}  // namespace tandem
