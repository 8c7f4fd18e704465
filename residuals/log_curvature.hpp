#pragma once

#include <tandem/lie/exp_curvature.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/lie/se3.hpp>

namespace tandem::detail {

/// Second derivatives of residuals r = Log(…), contracted with a covector w: of φ = wᵀ r by right perturbations of the
/// states. What is not linear in them is Log, and the product of perturbations: Exp(a) Exp(b) = Exp(a + b + ½ [a, b] + …).

/// Log's part of the states whose Jacobians of e are Ja and Jb; λ = Jr⁻¹(e)ᵀ w.
template <LieGroup G>
class LogCurvature {
 public:
  using Jacobian = typename G::Jacobian;

  LogCurvature(const typename G::Tangent& e, const typename G::Tangent& lambda)
      : minus_(-ExpCurvature<G>::of(e, lambda)) {}
  Jacobian operator()(const Jacobian& Ja, const Jacobian& Jb) const {
    const Jacobian right = minus_ * Jb;
    return Ja.transpose() * right;
  }

 private:
  Jacobian minus_;
};

/// Puts the part of e = Log(… X⁻¹ Y …) into H, 2 dof × 2 dof: E = X⁻¹ Y; λ = Jr⁻¹(e)ᵀ w; Jx, Jy those of e. The product of
/// perturbations is E Exp(−Ad(E⁻¹) x) Exp(y), on which the gradient of φ is Jyᵀ w.
template <LieGroup G>
void curvature_of_between(const G& E, const typename G::Tangent& e, const typename G::Tangent& lambda,
                          const typename G::Tangent& gradient_y, const typename G::Jacobian& Jx,
                          const typename G::Jacobian& Jy, Matrix<2 * G::dof, 2 * G::dof, typename G::Scalar>& H) {
  using Jacobian = typename G::Jacobian;
  constexpr int n = G::dof;
  const LogCurvature<G> log(e, lambda);
  const Jacobian bracket = typename G::Scalar(0.5) * ExpCurvature<G>::bracket(gradient_y), moved = E.inverse().Ad();
  Jacobian mixed = log(Jx, Jy);
  mixed.noalias() -= moved.transpose() * bracket;
  H.template topLeftCorner<n, n>() = log(Jx, Jx);
  H.template topRightCorner<n, n>() = mixed;
  H.template bottomLeftCorner<n, n>() = mixed.transpose();
  H.template bottomRightCorner<n, n>() = log(Jy, Jy);
}
// Compiled once, in log_curvature.cpp.
extern template void curvature_of_between<SE3>(const SE3&, const SE3::Tangent&, const SE3::Tangent&,
                                               const SE3::Tangent&, const SE3::Jacobian&, const SE3::Jacobian&,
                                               Matrix<12, 12>&);

}  // namespace tandem::detail
