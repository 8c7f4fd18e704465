#pragma once

#include <tandem/lie/operations.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/log_curvature.hpp>
#include <tandem/residuals/residual.hpp>
#include <tandem/residuals/residual_functions.hpp>

namespace tandem {

/// Measured pose of one frame in another [m, rad]:  e = Log(Z⁻¹ (X B)⁻¹ (Y F)). Used for odometry from X to Y, or for a
/// sensor mounted at B on the chaser X that sees a marker at F on the target Y. Source: Baxter & Teran Espinoza 2025,
/// §V-A, eqs. 9-14 (odometry, optical); exact Jacobians after Solà et al. 2018, eqs. 67-82.
template <LieGroup G = SE3>
struct RelativePose {
  static constexpr std::string_view name = "relative pose";
  static constexpr int dim = G::dof;
  static constexpr bool linear = is_vector_space<G>;
  using States = std::tuple<G, G>;

  G z;    ///< pose of the frame Y F in the frame X B
  G B{};  ///< sensor in the body X
  G F{};  ///< marker in the body Y

  auto fields() { return std::tie(z, B, F); }

  template <Over<G> X>
  void operator()(const X& x, const X& y, Rows<dim, X>& r, RowsBy<dim, X>* Jx = nullptr,
                  RowsBy<dim, X>* Jy = nullptr) const {
    using S = typename X::Scalar;
    const X from = (B * z).inverse().template cast<S>(), marker = F.template cast<S>();
    r = (from * x.inverse() * y * marker).Log();
    if (!Jx && !Jy) return;
    const InverseJacobians<X> at_r(r);
    if (Jx) *Jx = -multiply<X>(at_r.left, from.Ad());
    if (Jy) *Jy = multiply<X>(at_r.right, marker.inverse().Ad());
  }

  void curvature(const G& x, const G& y, const Rows<dim, G>& w,
                 Matrix<2 * G::dof, 2 * G::dof, typename G::Scalar>& H) const requires HasExpCurvature<G> {
    const G from = (B * z).inverse(), E = x.inverse() * y;
    const typename G::Tangent e = (from * E * F).Log();
    const InverseJacobians<G> at_e(e);
    const typename G::Jacobian Jx = -multiply<G>(at_e.left, from.Ad()), Jy = multiply<G>(at_e.right, F.inverse().Ad());
    detail::curvature_of_between<G>(E, e, at_e.right.transpose() * w, Jy.transpose() * w, Jx, Jy, H);
  }
};

// Instantiated in relative_pose.cpp.
namespace detail {
extern template struct FunctionsOf<RelativePose<SE3>>;
extern template struct FunctionsOf<RelativePose<SE2>>;
extern template struct FunctionsOf<RelativePose<Rn<1>>>;
extern template struct FunctionsOf<RelativePose<Rn<3>>>;
extern template struct FunctionsOf<RelativePose<Rn<6>>>;
}  // namespace detail

}  // namespace tandem
