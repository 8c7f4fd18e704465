#include <algorithm>
#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/residuals/bounds.hpp>
#include <tandem/solvers/calibration/evidence.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>

#include "walk.hpp"

/// The evidence with robust losses.
namespace tandem::testing {
namespace {

struct TailedWalk : Walk {
  static constexpr double kDof = 4;
  std::vector<MeasuredBlock> measured;
  std::vector<Problem*> problems{&problem};
  CalibrationOptions options;

  TailedWalk(int length, double steps) : Walk(1, length) {
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    std::student_t_distribution<double> t(kDof);
    step_sigma = steps;
    double x = 0;
    for (double& fix : z) {
      fix = x + fix_sigma * t(random);
      x += step_sigma * normal(random);
    }
    given_step_sigma = step_sigma;
    given_fix_sigma = fix_sigma * std::sqrt(kDof / (kDof + 1));  // the Gaussian with the curvature of the peak
    initial_sigma = 1;
    build(StudentT(kDof, 1));
    for (const NoiseRows& rows : fixes.rows) measured.push_back({rows.block});
    options.measured = measured;
    options.absolute_evidence = true;
  }
  /// Returns the exact log evidence by a Bayes filter on a grid of states.
  double by_grid() const {
    constexpr double kApart = 0.05;
    const auto [least, most] = std::minmax_element(z.begin(), z.end());
    const double low = std::min(*least, -8.0) - 2;
    const int size = int((std::max(*most, 8.0) + 2 - low) / kApart), reach = int(8 * step_sigma / kApart);
    const auto normal = [](double x, double sigma) {
      return std::exp(-0.5 * x * x / (sigma * sigma)) / (sigma * std::sqrt(2 * M_PI));
    };
    Eigen::VectorXd density(size), step(2 * reach + 1);
    for (int i = 0; i < size; ++i) density[i] = normal(low + i * kApart, initial_sigma);
    for (int i = -reach; i <= reach; ++i) step[reach + i] = kApart * normal(i * kApart, step_sigma);
    const double constant = std::lgamma(0.5 * (kDof + 1)) - std::lgamma(0.5 * kDof) - 0.5 * std::log(M_PI * kDof);
    double sum = 0;
    for (std::size_t k = 0; k < z.size(); ++k) {
      if (k > 0) {
        Eigen::VectorXd next = Eigen::VectorXd::Zero(size);
        for (int i = 0; i < size; ++i)
          for (int j = std::max(0, i - reach); j < std::min(size, i + reach + 1); ++j)
            next[i] += density[j] * step[reach + i - j];
        density = next;
      }
      for (int i = 0; i < size; ++i) {
        const double e = (z[k] - low - i * kApart) / fix_sigma;
        density[i] *= std::exp(constant - 0.5 * (kDof + 1) * std::log1p(e * e / kDof)) / fix_sigma;
      }
      const double here = kApart * density.sum();
      sum += std::log(here);
      density /= here;
    }
    return sum;
  }
};

/// Without the tail terms, the error is 0.1 per fix at a leverage of one third.
TEST(LossTerms, TheEvidenceAgreesWithAGridFilter) {
  for (const double steps : {0.3, 0.7, 1.2}) {
    TailedWalk tailed(80, steps);
    const std::vector<NoiseGroup> none;
    detail::Evidence evidence(tailed.problems, none, tailed.options);
    const detail::Evidence::Value value = evidence.at(Eigen::VectorXd());
    ASSERT_TRUE(value.usable) << value.why;
    EXPECT_NEAR(value.log_evidence + log_constants(tailed.problems, tailed.measured), tailed.by_grid(), 0.2) << steps;
  }
}

TEST(LossTerms, TheGradientAgreesWithDifferences) {
  TailedWalk tailed(200, 0.6);
  const std::vector<NoiseGroup> groups{tailed.steps, tailed.fixes};
  detail::Evidence evidence(tailed.problems, groups, tailed.options);
  const auto at = [&](double steps, double fixes) { return evidence.at(Eigen::Vector2d(steps, fixes)); };
  constexpr double kStep = 1e-3;
  for (const double steps : {-0.5, 0.3})
    for (const double fixes : {-0.3, 0.2}) {
      const Eigen::VectorXd gradient = at(steps, fixes).gradient;
      const double by_steps = at(steps + kStep, fixes).log_evidence - at(steps - kStep, fixes).log_evidence;
      const double by_fixes = at(steps, fixes + kStep).log_evidence - at(steps, fixes - kStep).log_evidence;
      EXPECT_NEAR(gradient[0], by_steps / (2 * kStep), 5e-3);
      EXPECT_NEAR(gradient[1], by_fixes / (2 * kStep), 5e-3);
    }
}

/// Robust losses on measurements and on the steps, with and without the integral of the priors.
TEST(LossTerms, TheGradientIsThatOfTheEvidenceForEveryLoss) {
  for (const Loss& loss : {Huber(1), Cauchy(1.5), GemanMcClure(3), Tukey(5), StudentT(4, 1)})
    for (const bool measured : {false, true}) {
      Walk walk(8, 40);
      for (const std::size_t k : {5u, 17u, 18u}) walk.z[k] += 4;
      walk.build(loss);
      for (const NoiseRows& step : walk.steps.rows) walk.problem.set_loss(step.block, Cauchy(2));
      const std::vector<NoiseGroup> groups{walk.steps, walk.fixes};
      CalibrationOptions options;
      if (measured)
        for (const NoiseRows& rows : walk.fixes.rows) options.measured.push_back({rows.block});
      Problem* const one[] = {&walk.problem};
      detail::Evidence evidence(one, groups, options);
      const auto at = [&](double steps, double fixes) { return evidence.at(Eigen::Vector2d(steps, fixes)); };
      constexpr double kStep = 1e-3;
      for (const double fixes : {-0.3, 0.2}) {
        const Eigen::VectorXd gradient = at(0.1, fixes).gradient;
        const double by_steps = at(0.1 + kStep, fixes).log_evidence - at(0.1 - kStep, fixes).log_evidence;
        const double by_fixes = at(0.1, fixes + kStep).log_evidence - at(0.1, fixes - kStep).log_evidence;
        EXPECT_NEAR(gradient[0], by_steps / (2 * kStep), 2e-3) << int(loss.kind) << measured;
        EXPECT_NEAR(gradient[1], by_fixes / (2 * kStep), 2e-3) << int(loss.kind) << measured;
      }
    }
}

TEST(LossTerms, TheGradientIsThatOfTheEvidenceWithEqualities) {
  Walk walk(8, 30);
  walk.z[12] += 4;
  walk.build(Cauchy(1.5));
  walk.problem.subject_to(RelativePose<Number>{Number(Vector<1>(0.2))}, equal_to(0),
                          {walk.variables[5], walk.variables[14]});
  const std::vector<NoiseGroup> groups{walk.steps, walk.fixes};
  const CalibrationOptions options;
  Problem* const one[] = {&walk.problem};
  detail::Evidence evidence(one, groups, options);
  const Eigen::VectorXd gradient = evidence.at(Eigen::Vector2d::Zero()).gradient;
  for (int g = 0; g < 2; ++g) {
    const Eigen::Vector2d h = 1e-3 * Eigen::Vector2d::Unit(g);
    EXPECT_NEAR(gradient[g], (evidence.at(h).log_evidence - evidence.at(-h).log_evidence) / 2e-3, 5e-3) << g;
  }
}

/// The derivative of log det H by the weights is as large as that by the noise here. Without it, the gradient is 0.14
/// where the evidence has a slope of 0.005, and no step from the root of the gradient increases the evidence.
TEST(LossTerms, AFewMeasurementsOfOneValueAreCalibrated) {
  Problem problem;
  const auto x = problem.add(Number());
  NoiseGroup fixes{"fixes", {}, 0};
  for (const double z : {-1.2, -0.4, 0.1, 0.3, 0.9, 6.0})
    fixes.rows.push_back({problem.minimize(Prior<Number>{Number(Vector<1>(z))}, {1.0}, {x}, Cauchy(1.5))});
  const std::vector<NoiseGroup> groups{fixes};
  Problem* const one[] = {&problem};
  const CalibrationOptions options;
  detail::Evidence evidence(one, groups, options);
  const auto at = [&](double factor) { return evidence.at(Vector<1>(factor)); };
  for (const double factor : {-0.4, 0.0, 0.3})
    EXPECT_NEAR(at(factor).gradient[0], (at(factor + 1e-3).log_evidence - at(factor - 1e-3).log_evidence) / 2e-3, 1e-5);

  const Calibration found = calibrate(problem, groups);
  ASSERT_EQ(found.status, Status::converged) << found.message;
  CalibrationOptions counted;
  counted.counted_rows = found.counted_rows;
  detail::Evidence there(one, groups, counted);
  EXPECT_NEAR(there.at(Vector<1>(std::log(found.noise[0].factor))).gradient[0], 0, 0.01);
}

TEST(LossTerms, RejectsImproperDensity) {
  TailedWalk tailed(20, 0.6);
  tailed.problem.set_loss(tailed.measured[3].block, Loss{Loss::Kind::student_t, 0.9});
  const std::vector<NoiseGroup> groups{tailed.fixes};
  EXPECT_THAT([&] { calibrate(tailed.problems, groups, tailed.options); },
              ::testing::ThrowsMessage<Error>(::testing::HasSubstr("improper density")));
}

}  // namespace
}  // namespace tandem::testing
