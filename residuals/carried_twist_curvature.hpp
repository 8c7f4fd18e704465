#pragma once

#include <tandem/lie/operations.hpp>
#include <tandem/residuals/log_curvature.hpp>

namespace tandem::detail {

/// Fills H with the Hessian of wᵀ e with respect to right perturbations of T0, T1, T2, where e is the residual of
/// ConstantTwist or DampedTwist:
///
///   e = T2 ⊖ (T1 ⊕ δ2),   δ1 = T1 ⊖ T0,   δ2 = gain ∘ δ1 + drift
///
/// If all gains are equal (`kUniformGain`), the Jacobians have the group's block structure.
///
/// With A = T0⁻¹ T1, B = T1⁻¹ T2 and v = −δ2, e = Log(Exp(v) B). To first order the perturbations move Exp(v) by p and
/// B by z, both in the frame of B. The Hessian is the sum of the contributions of the product Exp(v) B, of Exp, of
/// Log(A), and of the products in A and B.
template <LieGroup G, bool kUniformGain>
void curvature_of_carried_twist(const G& t0, const G& t1, const G& t2, const typename G::Tangent& gain,
                                const typename G::Tangent& drift, const typename G::Tangent& w,
                                Matrix<3 * G::dof, 3 * G::dof, typename G::Scalar>& H) {
  using Tangent = typename G::Tangent;
  using Jacobian = typename G::Jacobian;
  constexpr int n = G::dof;
  const auto times = [](const Jacobian& a, const Jacobian& b) -> Jacobian {
    if constexpr (kUniformGain) return multiply<G>(a, b);
    return a * b;
  };
  const G A = t0.inverse() * t1, B = t1.inverse() * t2;
  const Tangent d1 = A.Log(), v = -gain.cwiseProduct(d1) - drift, e = (G::Exp(v) * B).Log();
  const InverseJacobians<G> at_d1(d1);
  const Jacobian from_B = B.inverse().Ad(), Jr_v = G::Jr(v), at_e = G::Jr_inverse(e);
  const Jacobian by_d1 = -multiply<G>(from_B, Jr_v) * gain.asDiagonal();
  const Jacobian p0 = -times(by_d1, at_d1.left), p1 = times(by_d1, at_d1.right);
  const Jacobian J0 = times(at_e, p0), J1 = times(at_e, p1 - from_B);

  // Gradients of φ = wᵀ e with respect to perturbations of the product, of Exp(v), and of A.
  const Tangent of_M = at_e.transpose() * w, of_v = from_B.transpose() * of_M;
  const Tangent of_A = -at_d1.right.transpose() * gain.cwiseProduct(Jr_v.transpose() * of_v);
  const typename G::Scalar half(0.5);
  const Jacobian bracket_M = half * ExpCurvature<G>::bracket(of_M), bracket_A = half * ExpCurvature<G>::bracket(of_A);
  const LogCurvature<G> log(e, of_M);
  const Jacobian of_Exp = gain.asDiagonal() * ExpCurvature<G>::hessian(v, of_v) * gain.asDiagonal();
  const Jacobian S = of_Exp - ExpCurvature<G>::hessian(d1, of_A);
  const Jacobian S_left = S * at_d1.left, S_right = S * at_d1.right;
  const Jacobian z1 = bracket_M * from_B;  // z of T1 in the bracket, negated; for T2 this is bracket_M

  const auto put = [&](int row, int column, const Jacobian& block) {
    H.template block<n, n>(n * row, n * column) = block;
    if (row != column) H.template block<n, n>(n * column, n * row) = block.transpose();
  };
  put(0, 0, log(J0, J0) + at_d1.left.transpose() * S_left);
  put(0, 1,
      log(J0, J1) - at_d1.left.transpose() * S_right - p0.transpose() * z1 - A.inverse().Ad().transpose() * bracket_A);
  put(0, 2, log(J0, at_e) + p0.transpose() * bracket_M);
  const Jacobian p1_z1 = p1.transpose() * z1;
  put(1, 1, log(J1, J1) + at_d1.right.transpose() * S_right - p1_z1 - p1_z1.transpose());
  put(1, 2, log(J1, at_e) + p1.transpose() * bracket_M - from_B.transpose() * bracket_M);
  put(2, 2, log(at_e, at_e));
}
// Instantiated in log_curvature.cpp.
extern template void curvature_of_carried_twist<SE3, true>(const SE3&, const SE3&, const SE3&, const SE3::Tangent&,
                                                           const SE3::Tangent&, const SE3::Tangent&, Matrix<18, 18>&);
extern template void curvature_of_carried_twist<SE3, false>(const SE3&, const SE3&, const SE3&, const SE3::Tangent&,
                                                            const SE3::Tangent&, const SE3::Tangent&, Matrix<18, 18>&);

}  // namespace tandem::detail
