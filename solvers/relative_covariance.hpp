#pragma once

#include <tandem/lie/lie_group.hpp>

namespace tandem {

namespace detail {
/// Returns J S Jᵀ. Rows that read an entry of infinite variance have an infinite variance and zero covariances.
Eigen::MatrixXd propagated(const Eigen::Ref<const Eigen::MatrixXd>& J, const Eigen::Ref<const Eigen::MatrixXd>& S);
}  // namespace detail

/// Returns the covariance of the relative pose D = C⁻¹ T, in right perturbations of D. `joint` is the covariance of
/// [δC; δT] (Marginals::joint). To first order, D ⊕ d has d = −Ad(D⁻¹) δC + δT.
template <LieGroup G>
Matrix<G::dof, G::dof> relative_pose_covariance(const G& c, const G& t, const Matrix<2 * G::dof, 2 * G::dof>& joint) {
  Matrix<G::dof, 2 * G::dof> J;
  J << -(t.inverse() * c).Ad(), Matrix<G::dof, G::dof>::Identity();
  return detail::propagated(J, joint);
}

/// Returns the covariance [m²] of the target's position in the chaser's frame, p = C⁻¹ t(T). `joint` is the covariance
/// of [δC; δT]. The target is a pose or a point (SE3 and R3, SE2 and R2).
template <LieGroup Chaser, LieGroup Target>
requires(Chaser::point_dim == Target::point_dim)
    Matrix<Chaser::point_dim, Chaser::point_dim> relative_position_covariance(
        const Chaser& c, const Target& t, const Matrix<Chaser::dof + Target::dof, Chaser::dof + Target::dof>& joint) {
  const Vector<Chaser::point_dim> origin = Vector<Chaser::point_dim>::Zero();
  const Chaser to_body = c.inverse();
  Matrix<Chaser::point_dim, Chaser::dof + Target::dof> J;
  J << -Chaser::identity().act_jacobian(to_body.act(t.act(origin))),
      to_body.act_point_jacobian() * t.act_jacobian(origin);
  return detail::propagated(J, joint);
}

}  // namespace tandem
