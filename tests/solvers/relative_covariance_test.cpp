#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/solvers/relative_covariance.hpp>

#include "problem/mixed_problem.hpp"

namespace tandem::testing {
namespace {

template <int N>
Matrix<N, N> some_covariance(unsigned seed) {
  const Eigen::VectorXd entries = random_vector(N * N, 1.0, seed);
  const Matrix<N, N> root = Eigen::Map<const Matrix<N, N>>(entries.data());
  return root * root.transpose();
}

template <LieGroup G>
G some(unsigned seed) {
  return G::Exp(random_vector(G::dof, 1.0, seed));
}

/// Returns J S Jᵀ, with J from differences of f(δC, δT).
template <class F>
Eigen::MatrixXd propagated(const Eigen::MatrixXd& joint, F f) {
  const Eigen::MatrixXd J = differences(Eigen::VectorXd::Zero(joint.rows()), f);
  return J * joint * J.transpose();
}

template <class G>
void check_pose() {
  constexpr int n = G::dof;
  const G c = some<G>(1), t = some<G>(2);
  const G d = c.inverse() * t;
  const auto joint = some_covariance<2 * n>(3);
  const Eigen::MatrixXd expected = propagated(joint, [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    const G moved = (c * G::Exp(v.head<n>())).inverse() * (t * G::Exp(v.tail<n>()));
    return (d.inverse() * moved).Log();
  });
  EXPECT_LE((relative_pose_covariance(c, t, joint) - expected).norm(), 1e-10 * expected.norm());
}

template <class Chaser, class Target>
void check_position() {
  constexpr int n = Chaser::dof, m = Target::dof, d = Chaser::point_dim;
  const Chaser c = some<Chaser>(4);
  const Target t = some<Target>(5);
  const auto joint = some_covariance<n + m>(6);
  const Eigen::MatrixXd expected = propagated(joint, [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    return (c * Chaser::Exp(v.head<n>())).inverse().act((t * Target::Exp(v.tail<m>())).act(Vector<d>::Zero()));
  });
  EXPECT_LE((relative_position_covariance(c, t, joint) - expected).norm(), 1e-10 * expected.norm());
}

TEST(RelativeCovariance, MatchesDifferencesForPoses) {
  check_pose<SE3>();
  check_pose<SE2>();
}

TEST(RelativeCovariance, MatchesDifferencesForPositions) {
  check_position<SE3, R3>();
  check_position<SE3, SE3>();
  check_position<SE2, R2>();
  check_position<SE2, SE2>();
}

/// The position covariance is the translation block of the pose covariance, rotated by R_D.
TEST(RelativeCovariance, PositionAgreesWithPose) {
  const SE3 c = some<SE3>(7), t = some<SE3>(8);
  const auto joint = some_covariance<12>(9);
  const Matrix<3, 3> R = (c.inverse() * t).rotation().matrix();
  const Matrix<3, 3> expected = R * relative_pose_covariance(c, t, joint).topLeftCorner<3, 3>() * R.transpose();
  EXPECT_TRUE(relative_position_covariance(c, t, joint).isApprox(expected, 1e-13));
}

}  // namespace
}  // namespace tandem::testing
