#pragma once

#include <tandem/lie/exp_curvature.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/lie/se3.hpp>

namespace tandem::detail {

/// Second derivatives of φ = wᵀ r for residuals r = Log(…), with respect to right perturbations of the states. Two
/// parts are nonlinear: Log, and the product of perturbations, Exp(a) Exp(b) = Exp(a + b + ½ [a, b] + …).

/// Contribution of Log to the Hessian block of two states with the Jacobians Ja and Jb of e; λ = Jr⁻¹(e)ᵀ w.
template <LieGroup G>
class LogCurvature {
 public:
  using Jacobian = typename G::Jacobian;

  LogCurvature(const typename G::Tangent& e, const typename G::Tangent& lambda)
      : minus_(-ExpCurvature<G>::hessian(e, lambda)) {}
  Jacobian operator()(const Jacobian& Ja, const Jacobian& Jb) const {
    const Jacobian right = minus_ * Jb;
    return Ja.transpose() * right;
  }

 private:
  Jacobian minus_;
};

/// Fills H (2 dof × 2 dof) with the Hessian of e = Log(… X⁻¹ Y …) with respect to X and Y. Here E = X⁻¹ Y, λ = Jr⁻¹(e)ᵀ
/// w, and Jx, Jy are the Jacobians of e. The product of the perturbations x and y is E Exp(−Ad(E⁻¹) x) Exp(y); the
/// gradient of φ with respect to it is Jyᵀ w.
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
// Instantiated in log_curvature.cpp.
extern template void curvature_of_between<SE3>(const SE3&, const SE3::Tangent&, const SE3::Tangent&,
                                               const SE3::Tangent&, const SE3::Jacobian&, const SE3::Jacobian&,
                                               Matrix<12, 12>&);

}  // namespace tandem::detail
