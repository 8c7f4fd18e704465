#include <cmath>
#include <random>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <tandem/residuals/bounds.hpp>
#include <tandem/solvers/calibration/evidence.hpp>

#include "walk.hpp"

namespace tandem::testing {
namespace {

using R2 = Rn<2>;

TEST(Evidence, IsExactForALinearProblem) {
  Walk walk(1, 60);
  walk.build();
  Problem* const one[] = {&walk.problem};
  const std::vector<NoiseGroup> groups = {walk.steps, walk.fixes};
  const CalibrationOptions options;
  detail::Evidence evidence(one, groups, options);
  const double constant = evidence.at(Eigen::Vector2d::Zero()).log_evidence - walk.exact(0, 0);
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(0.5, -0.3), Eigen::Vector2d(-1, 0.2), Eigen::Vector2d(2, 1)}) {
    const auto value = evidence.at(at);
    ASSERT_TRUE(value.usable) << value.why;
    EXPECT_NEAR(value.log_evidence - constant, walk.exact(at[0], at[1]), 1e-8 * std::abs(value.log_evidence));
    const double h = 1e-4;
    EXPECT_NEAR(value.gradient[0], (walk.exact(at[0] + h, at[1]) - walk.exact(at[0] - h, at[1])) / (2 * h), 1e-4);
    EXPECT_NEAR(value.gradient[1], (walk.exact(at[0], at[1] + h) - walk.exact(at[0], at[1] - h)) / (2 * h), 1e-4);
  }
}

TEST(Evidence, NormalisesOverlappingPriors) {
  // A walk with a second prior at 0. The product of both priors is not normalised.
  Walk walk(4, 60);
  walk.build();
  NoiseGroup level{"level", {}, 0};
  CalibrationOptions options;
  for (const NoiseRows& fix : walk.fixes.rows) {
    options.measured.push_back({fix.block});
    const int x = walk.problem.linearization(fix.block).variable_ids[0];
    level.rows.push_back({walk.problem.minimize(Prior<Number>{Number()}, {2.0}, {walk.variables[std::size_t(x)]})});
  }
  const auto exact = [&](double log_steps, double log_level) {
    const double q = std::exp(2 * log_steps), l = 4 * std::exp(2 * log_level);
    Eigen::MatrixXd information = Eigen::MatrixXd::Identity(walk.n, walk.n) / l;
    information(0, 0) += 1 / (walk.initial_sigma * walk.initial_sigma);
    for (int i = 1; i < walk.n; ++i) {
      information(i, i) += 1 / q;
      information(i - 1, i - 1) += 1 / q;
      information(i, i - 1) -= 1 / q;
      information(i - 1, i) -= 1 / q;
    }
    const Eigen::MatrixXd S = information.inverse() + Eigen::MatrixXd::Identity(walk.n, walk.n);
    const Eigen::LLT<Eigen::MatrixXd> llt(S);
    const Eigen::Map<const Eigen::VectorXd> d(walk.z.data(), walk.n);
    return -0.5 * d.dot(llt.solve(d)) - llt.matrixLLT().diagonal().array().log().sum();
  };
  Problem* const one[] = {&walk.problem};
  const std::vector<NoiseGroup> groups = {walk.steps, level};
  detail::Evidence evidence(one, groups, options);
  const double constant = evidence.at(Eigen::Vector2d::Zero()).log_evidence - exact(0, 0);
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(-0.7, 0.4), Eigen::Vector2d(0.5, -1), Eigen::Vector2d(-3, 1)}) {
    const auto value = evidence.at(at);
    ASSERT_TRUE(value.usable) << value.why;
    EXPECT_NEAR(value.log_evidence - constant, exact(at[0], at[1]), 0.02);
    const double h = 1e-5;
    EXPECT_NEAR(value.gradient[0], (exact(at[0] + h, at[1]) - exact(at[0] - h, at[1])) / (2 * h), 0.02);
    EXPECT_NEAR(value.gradient[1], (exact(at[0], at[1] + h) - exact(at[0], at[1] - h)) / (2 * h), 0.02);
  }
}

/// A wide prior leaves directions that only measurements determine. The integral of the priors then depends on the
/// measurements' given noise, but not on its factor.
TEST(Evidence, TheIntegralOfThePriorsDoesNotDependOnTheNoiseOfTheMeasurements) {
  Walk walk(4, 60);
  walk.initial_sigma = 1e3;
  walk.build();
  CalibrationOptions options;
  for (const NoiseRows& fix : walk.fixes.rows) options.measured.push_back({fix.block});
  Problem* const one[] = {&walk.problem};
  const std::vector<NoiseGroup> groups = {walk.fixes};
  detail::Evidence evidence(one, groups, options);
  const double constant = evidence.at(Vector<1>(0)).log_evidence - walk.exact(0, 0);
  for (const double factor : {-1.0, 0.3, 1.5}) {
    const auto value = evidence.at(Vector<1>(factor));
    EXPECT_NEAR(value.log_evidence - constant, walk.exact(0, factor), 1e-5);
    const double slope = (walk.exact(0, factor + 1e-3) - walk.exact(0, factor - 1e-3)) / 2e-3;
    EXPECT_NEAR(value.gradient[0], slope, 1e-4);
  }
}

/// The priors alone leave the position of the walk undetermined, with a variance that dwarfs those of its steps.
TEST(Evidence, TheGradientIsThatOfTheAbsoluteEvidenceWithAnImproperPrior) {
  Walk walk(4, 400);
  walk.initial_sigma = 1e12;
  walk.given_step_sigma = 0.02;
  walk.build();
  CalibrationOptions options;
  options.absolute_evidence = true;
  for (const NoiseRows& fix : walk.fixes.rows) options.measured.push_back({fix.block});
  Problem* const one[] = {&walk.problem};
  const std::vector<NoiseGroup> groups = {walk.steps, walk.fixes};
  detail::Evidence evidence(one, groups, options);
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(0, 0), Eigen::Vector2d(2.5, -0.3)}) {
    const Eigen::VectorXd gradient = evidence.at(at).gradient;
    for (int g = 0; g < 2; ++g) {
      const Eigen::Vector2d h = 1e-3 * Eigen::Vector2d::Unit(g);
      const double slope = (evidence.at(at + h).log_evidence - evidence.at(at - h).log_evidence) / 2e-3;
      EXPECT_NEAR(gradient[g], slope, 1e-4 * std::max(1.0, std::abs(slope))) << g << " at " << at.transpose();
    }
  }
}

TEST(Evidence, ReturnsTheAverageInformation) {
  for (const bool measured : {false, true}) {
    Walk walk(5, 40);
    walk.build();
    CalibrationOptions options;
    if (measured)
      for (const NoiseRows& fix : walk.fixes.rows) options.measured.push_back({fix.block});
    Problem* const one[] = {&walk.problem};
    const std::vector<NoiseGroup> groups = {walk.steps, walk.fixes};
    detail::Evidence evidence(one, groups, options);
    const Eigen::Vector2d at(-0.4, 0.3);
    ASSERT_TRUE(evidence.at(at).usable);
    const auto information = evidence.information();
    ASSERT_TRUE(information);

    // ½ (P z)ᵀ V_g P V_h P z, where P = V⁻¹ is the inverse covariance of z and V_g a derivative of V.
    const double q = std::exp(2 * at[0]), r = std::exp(2 * at[1]);
    Eigen::MatrixXd of_steps(walk.n, walk.n);
    for (int i = 0; i < walk.n; ++i)
      for (int j = 0; j < walk.n; ++j) of_steps(i, j) = q * std::min(i, j);
    const Eigen::MatrixXd of_fixes = r * Eigen::MatrixXd::Identity(walk.n, walk.n);
    const Eigen::MatrixXd initial_sigma =
        Eigen::MatrixXd::Constant(walk.n, walk.n, walk.initial_sigma * walk.initial_sigma);
    const Eigen::LLT<Eigen::MatrixXd> V(initial_sigma + of_steps + of_fixes);
    const Eigen::VectorXd Pz = V.solve(Eigen::Map<const Eigen::VectorXd>(walk.z.data(), walk.n));
    Eigen::MatrixXd pulled(walk.n, 2);
    pulled << 2 * of_steps * Pz, 2 * of_fixes * Pz;
    const Eigen::Matrix2d expected = 0.5 * pulled.transpose() * V.solve(pulled);
    EXPECT_LE((*information - expected).cwiseAbs().maxCoeff(), (measured ? 1e-3 : 1e-7) * expected.maxCoeff())
        << *information << "\n\n"
        << expected;
  }
}

/// Blocks with a full covariance whose rows are in different groups, with a hard equality.
TEST(Evidence, HasTheRightGradientForFullCovariancesAndEqualities) {
  Problem problem;
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  Eigen::Matrix2d S;
  S << 2, 0.8, 0.8, 1;
  NoiseGroup first{"first", {}, 0.7}, second{"second", {}, 0}, steps{"steps", {}, 0};
  std::vector<Variable<R2>> x;
  for (int i = 0; i < 12; ++i) {
    x.push_back(problem.add(R2(Vector<2>(0, 0))));
    const Block fix = problem.minimize(Prior<R2>{R2(Vector<2>{2 * normal(random), normal(random)})},
                                       Gaussian::covariance(S), {x.back()});
    first.rows.push_back({fix, 0, 1});
    second.rows.push_back({fix, 1, 1});
    if (i > 0)
      steps.rows.push_back({problem.minimize(RelativePose<R2>{R2()}, {0.7, 0.4}, {x[std::size_t(i) - 1], x.back()})});
  }
  problem.subject_to(RelativePose<R2>{R2(Vector<2>(0.3, 0.1))}, equal_to(0), {x[2], x[9]});
  Problem* const one[] = {&problem};
  const std::vector<NoiseGroup> groups = {first, second, steps};
  const CalibrationOptions options;
  detail::Evidence evidence(one, groups, options);
  const Eigen::Vector3d at(0.3, -0.2, 0.4);
  const Eigen::VectorXd gradient = evidence.at(at).gradient;
  for (int g = 0; g < 3; ++g) {
    const double h = 1e-4;
    const Eigen::Vector3d up = at + h * Eigen::Vector3d::Unit(g), down = at - h * Eigen::Vector3d::Unit(g);
    const double by = (evidence.at(up).log_evidence - evidence.at(down).log_evidence) / (2 * h);
    EXPECT_NEAR(gradient[g], by, 1e-5 * (1 + std::abs(by))) << groups[std::size_t(g)].name;
  }
}

}  // namespace
}  // namespace tandem::testing
