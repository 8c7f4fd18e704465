#include <Eigen/LU>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/planning/expected_fixes.hpp>
#include <tandem/problem/planning/target_prediction.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/usbl_position.hpp>

namespace tandem::testing {
namespace {

const ExpectedSensor kUsbl{0.5, {0.5, 0.4, 0.3}},
    kCamera{2.0, {0.05, 0.04, 0.06}, Vector<3>(0.03, 0.02, 0.01), FieldOfView{}};
const SE3 kChaser(SO3::Exp({0.2, -0.1, 0.7}), {1.0, 2.0, 3.0});
const SE3 kSeen = kChaser * SE3(SO3::Exp({0.4, 0.3, -1.0}), {4.0, 1.0, 0.5});
const SE3 kBehind = kChaser * SE3(SO3(), {-4.0, 0.0, 0.0});

/// Returns the information Jᵀ R⁻¹ J about the target of a residual at its measurement.
template <class R>
Matrix<6, 6> information(const R& residual, const SE3& target, const Eigen::VectorXd& sigma) {
  Vector<R::dim> r;
  Matrix<R::dim, 6> J;
  residual(kChaser, target, r, nullptr, &J);
  const Vector<R::dim> weight = sigma.cwiseAbs2().cwiseInverse();
  return J.transpose() * weight.asDiagonal() * J;
}

TEST(ExpectedFixes, EqualTheInformationOfTheSensorResiduals) {
  const auto fixes = expected_fixes({kUsbl, kCamera}, 2.0, {kChaser, kChaser}, {kSeen, kSeen});
  ASSERT_EQ(fixes.size(), 1u);
  const SE3 z = kChaser.inverse() * kSeen;
  Vector<6> sigma;
  sigma << kCamera.position, *kCamera.rotation;
  const double seen = Visibility{*kCamera.sight}.probability(z.translation());
  EXPECT_GT(seen, 0.9);
  const Matrix<6, 6> expected = 1.0 * information(UsblPosition<>{z.translation()}, kSeen, kUsbl.position) +
                                4.0 * seen * information(RelativePose<>{z}, kSeen, sigma);
  EXPECT_LE((fixes[0] - expected).norm(), 1e-12 * expected.norm());
}

TEST(ExpectedFixes, ExcludeSensorsWithoutSight) {
  const auto both = expected_fixes({kUsbl, kCamera}, 1.0, {kChaser, kChaser}, {kBehind, kBehind});
  const auto heard = expected_fixes({kUsbl}, 1.0, {kChaser, kChaser}, {kBehind, kBehind});
  EXPECT_LE((both[0] - heard[0]).norm(), 1e-6 * heard[0].norm());
  EXPECT_THROW(expected_fixes({kUsbl}, 1.0, {kChaser}, {}), Error);
}

/// Compares the recursion with the normal matrix of all poses: before, now and after each step.
TEST(ExpectedFixes, RecursionMatchesDenseProblem) {
  constexpr int steps = 6, n = 6 * (steps + 2);
  TargetBelief belief;
  belief.now = kSeen;
  Vector<6> twist;
  twist << 0.6, 0.05, -0.02, 0.01, 0.02, 0.1;
  belief.before = kSeen * SE3::Exp(-twist);
  Matrix<12, 12> A;
  for (int i = 0; i < 144; ++i) A.data()[i] = std::cos(1.0 + 0.7 * i);
  belief.covariance = 0.01 * (Matrix<12, 12>(A * A.transpose()) + Matrix<12, 12>::Identity());
  const Vector<6> noise = (Vector<6>() << 0.1, 0.05, 0.05, 0.01, 0.02, 0.03).finished();
  const TargetPrediction without = predict_target(belief, noise, 1.0, steps);
  std::vector<SE3> chaser;
  for (int k = 0; k <= steps; ++k) chaser.push_back(kChaser * SE3::Exp(Vector<6>(0.3 * k * Vector<6>::Unit(5))));
  const auto fixes = expected_fixes({kUsbl, kCamera}, 1.0, chaser, without.pose);
  const TargetPrediction with = predict_target(belief, noise, 1.0, steps, {}, fixes);

  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
  normal.topLeftCorner<12, 12>() = belief.covariance.inverse();
  std::vector<SE3> pose{belief.before};
  pose.insert(pose.end(), without.pose.begin(), without.pose.end());
  const Vector<6> weight = noise.cwiseAbs2().cwiseInverse();
  for (int k = 0; k < steps; ++k) {
    const std::size_t i = std::size_t(k);
    Matrix<6, 6> J0, J1, J2;
    Vector<6> e;
    ConstantTwist<SE3>{1.0, 1.0}(pose[i], pose[i + 1], pose[i + 2], e, &J0, &J1, &J2);
    Matrix<6, 18> J;
    J << J0, J1, J2;
    normal.block<18, 18>(6 * k, 6 * k) += J.transpose() * weight.asDiagonal() * J;
    normal.block<6, 6>(6 * k + 12, 6 * k + 12) += fixes[i];
    // Covariance of the pose after this step, without later information.
    const int size = 6 * k + 18;
    const Eigen::MatrixXd covariance = normal.topLeftCorner(size, size).inverse();
    const Matrix<6, 6> last = covariance.bottomRightCorner<6, 6>();
    EXPECT_LE((with.covariance[i + 1] - last).norm(), 1e-9 * last.norm()) << k;
    EXPECT_LT(with.covariance[i + 1].trace(), without.covariance[i + 1].trace());
  }
}

}  // namespace
}  // namespace tandem::testing
