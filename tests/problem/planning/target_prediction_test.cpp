#include <random>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/planning/target_prediction.hpp>

namespace tandem::testing {
namespace {

TargetBelief turning() {
  TargetBelief belief;
  belief.now = SE3(SO3::Exp({0.1, -0.2, 0.4}), {15.0, 4.0, -10.0});
  Vector<6> twist;
  twist << 0.8, 0.05, 0.02, 0.01, -0.01, 0.05;
  belief.dt = 0.5;
  belief.before = belief.now * SE3::Exp(-belief.dt * twist);
  return belief;
}

TEST(PredictTarget, KeepsConstantTwist) {
  const TargetBelief belief = turning();
  const TargetPrediction p = predict_target(belief, Vector<6>::Constant(0.01), 2.0, 20);
  ASSERT_EQ(p.pose.size(), 21u);
  const Vector<6> twist = (belief.before.inverse() * belief.now).Log() / 0.5;
  for (int k = 0; k <= 20; ++k) {
    const SE3 there = belief.now * SE3::Exp(2.0 * k * twist);
    EXPECT_LE((there.inverse() * p.pose[std::size_t(k)]).Log().norm(), 1e-11);
    EXPECT_LE((p.twist[std::size_t(k)] - twist).norm(), 1e-12);
  }
}

TEST(PredictTarget, CovarianceMatchesMonteCarlo) {
  TargetBelief belief = turning();
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  Matrix<12, 12> A;
  for (double& a : A.reshaped()) a = normal(random);
  belief.covariance = 1e-6 * Matrix<12, 12>(A * A.transpose());
  const Vector<6> noise = (Vector<6>() << 2e-3, 1e-3, 1e-3, 5e-4, 5e-4, 1e-3).finished();
  const double dt = 1.0;
  const int steps = 5, runs = 20000;
  const TargetPrediction p = predict_target(belief, noise, dt, steps);

  const Matrix<12, 12> L = belief.covariance.llt().matrixL();
  Matrix<6, 6> S = Matrix<6, 6>::Zero();
  for (int run = 0; run < runs; ++run) {
    Vector<12> z;
    for (double& x : z) x = normal(random);
    z = (L * z).eval();
    SE3 before = belief.before * SE3::Exp(Vector<6>(z.head<6>()));
    SE3 now = belief.now * SE3::Exp(Vector<6>(z.tail<6>()));
    double last = belief.dt;
    for (int k = 0; k < steps; ++k) {
      Vector<6> w;
      for (int i = 0; i < 6; ++i) w[i] = std::sqrt(dt) * noise[i] * normal(random);
      const SE3 next = now * SE3::Exp(Vector<6>(dt / last * (before.inverse() * now).Log())) * SE3::Exp(w);
      before = now;
      now = next;
      last = dt;
    }
    const Vector<6> e = (p.pose.back().inverse() * now).Log();
    S += e * e.transpose() / runs;
  }
  EXPECT_LE((S - p.covariance.back()).norm(), 0.04 * S.norm());  // 4 standard deviations of the sampling error are 3 %
  EXPECT_GT(p.covariance.back().trace(), p.covariance.front().trace());
}

TEST(PredictTarget, FixesAddInformation) {
  TargetBelief belief = turning();
  belief.covariance = 0.01 * Matrix<12, 12>::Identity();
  const Vector<6> noise = Vector<6>::Constant(0.02);
  const TargetPrediction without = predict_target(belief, noise, 1.0, 2);
  const Matrix<6, 6> none = Matrix<6, 6>::Zero(), fix = 50.0 * Matrix<6, 6>::Identity();
  const TargetPrediction with_none = predict_target(belief, noise, 1.0, 2, {}, {none, none});
  const TargetPrediction last = predict_target(belief, noise, 1.0, 2, {}, {none, fix});
  const TargetPrediction first = predict_target(belief, noise, 1.0, 2, {}, {fix, none});
  EXPECT_LE((with_none.covariance[2] - without.covariance[2]).norm(), 1e-15);
  EXPECT_LE((last.covariance[2].inverse() - without.covariance[2].inverse() - fix).norm(), 1e-9);
  EXPECT_LE((first.covariance[1].inverse() - without.covariance[1].inverse() - fix).norm(), 1e-9);
  EXPECT_LT(first.covariance[2].trace(), without.covariance[2].trace());
  EXPECT_GT(first.covariance[2].trace(), last.covariance[2].trace());
  EXPECT_THROW(predict_target(belief, noise, 1.0, 2, {}, {fix}), Error);
}

TEST(PredictTarget, DampedTwistDecays) {
  const TargetBelief belief = turning();
  const Vector<6> tau = (Vector<6>() << 10.0, 5.0, 5.0, 2.0, 2.0, 4.0).finished();
  const TargetPrediction p = predict_target(belief, Vector<6>::Constant(0.01), 0.5, 400, tau);
  const Vector<6> twist = (belief.before.inverse() * belief.now).Log() / belief.dt;
  for (const int k : {1, 7, 30})
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(p.twist[std::size_t(k)][i], twist[i] * std::exp(-0.5 * k / tau[i]), 1e-12);
  EXPECT_LE((p.pose[400].inverse() * p.pose[200]).Log().norm(), 1e-3);
}

/// 50 s of prediction with typical noise. At constant twist the covariance grows beyond any use.
TEST(PredictTarget, DampedTwistBoundsTheCovariance) {
  TargetBelief belief;
  belief.now = SE3(SO3(), {10.0, 0.0, 0.0});
  belief.before = SE3(SO3(), {9.0, 0.0, 0.0});
  const Vector<6> noise = (Vector<6>() << 0.15, 0.05, 0.05, 0.02, 0.02, 0.06).finished();
  const Vector<6> tau = (Vector<6>() << 20.0, 5.0, 5.0, 5.0, 5.0, 5.0).finished();
  const auto three_sigma = [](const TargetPrediction& p) {
    return 3 * std::sqrt(p.covariance.back().topLeftCorner<3, 3>().trace());
  };
  const double constant = three_sigma(predict_target(belief, noise, 1.0, 50));
  const double damped = three_sigma(predict_target(belief, noise, 1.0, 50, tau));
  EXPECT_GT(constant, 300.0);
  // Bound: the distance covered at the current speed plus 3 σ of the speed.
  EXPECT_LT(damped, 50.0 * (1.0 + 3 * 0.15 * std::sqrt(20.0 / 2)));
}

TEST(PredictTarget, RejectsTimesThatAreNotPositive) {
  TargetBelief belief = turning();
  EXPECT_THROW(predict_target(belief, Vector<6>::Zero(), 0.0, 3), Error);
  EXPECT_THROW(predict_target(belief, Vector<6>::Zero(), 1.0, 3, Vector<6>(Vector<6>::Zero())), Error);
  belief.dt = 0.0;
  EXPECT_THROW(predict_target(belief, Vector<6>::Zero(), 1.0, 3), Error);
}

}  // namespace
}  // namespace tandem::testing
