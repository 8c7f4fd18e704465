#pragma once

#include <tandem/lie/operations.hpp>
#include <tandem/residuals/log_curvature.hpp>

namespace tandem::detail {

/// Second derivatives of wᵀ e by right perturbations of T0, T1, T2 together: e = T2 ⊖ (T1 ⊕ δ2) of ConstantTwist and
/// DampedTwist, δ1 = T1 ⊖ T0, δ2 = share ∘ δ1 + drift. With shares that are all `kAlike` Jacobians have the group's
/// structure.
///
/// With A = T0⁻¹ T1, B = T1⁻¹ T2, v = −δ2: e = Log(Exp(v) B). To first order Exp(v) moves by p and B by z, both in B's
/// frame; then their product, Exp, Log(A) and the products in A and B have a part each.
template <LieGroup G, bool kAlike>
void curvature_of_carried_twist(const G& t0, const G& t1, const G& t2, const typename G::Tangent& share,
                                const typename G::Tangent& drift, const typename G::Tangent& w,
                                Matrix<3 * G::dof, 3 * G::dof, typename G::Scalar>& H) {
  using Tangent = typename G::Tangent;
  using Jacobian = typename G::Jacobian;
  constexpr int n = G::dof;
  const auto times = [](const Jacobian& a, const Jacobian& b) -> Jacobian {
    if constexpr (kAlike) return multiply<G>(a, b);
    return a * b;
  };
  const G A = t0.inverse() * t1, B = t1.inverse() * t2;
  const Tangent d1 = A.Log(), v = -share.cwiseProduct(d1) - drift, e = (G::Exp(v) * B).Log();
  const InverseJacobians<G> at_d1(d1);
  const Jacobian from_B = B.inverse().Ad(), Jr_v = G::Jr(v), at_e = G::Jr_inverse(e);
  const Jacobian by_d1 = -multiply<G>(from_B, Jr_v) * share.asDiagonal();
  const Jacobian p0 = -times(by_d1, at_d1.left), p1 = times(by_d1, at_d1.right);
  const Jacobian J0 = times(at_e, p0), J1 = times(at_e, p1 - from_B);

  // The gradient of φ by the perturbations of the product, of Exp(v), and of A.
  const Tangent of_M = at_e.transpose() * w, of_v = from_B.transpose() * of_M;
  const Tangent of_A = -at_d1.right.transpose() * share.cwiseProduct(Jr_v.transpose() * of_v);
  const typename G::Scalar half(0.5);
  const Jacobian bracket_M = half * ExpCurvature<G>::bracket(of_M), bracket_A = half * ExpCurvature<G>::bracket(of_A);
  const LogCurvature<G> log(e, of_M);
  const Jacobian of_Exp = share.asDiagonal() * ExpCurvature<G>::of(v, of_v) * share.asDiagonal();
  const Jacobian S = of_Exp - ExpCurvature<G>::of(d1, of_A);
  const Jacobian S_left = S * at_d1.left, S_right = S * at_d1.right;
  const Jacobian z1 = bracket_M * from_B;  // minus what z does to the bracket for T1; for T2 it is bracket_M

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
// Compiled once, in log_curvature.cpp.
extern template void curvature_of_carried_twist<SE3, true>(const SE3&, const SE3&, const SE3&, const SE3::Tangent&,
                                                           const SE3::Tangent&, const SE3::Tangent&, Matrix<18, 18>&);
extern template void curvature_of_carried_twist<SE3, false>(const SE3&, const SE3&, const SE3&, const SE3::Tangent&,
                                                            const SE3::Tangent&, const SE3::Tangent&, Matrix<18, 18>&);

}  // namespace tandem::detail
