#include <cmath>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <tandem/solvers/calibration/cross_validation.hpp>
#include <tandem/solvers/gauss_newton.hpp>

#include "walk.hpp"

namespace tandem::testing {
namespace {

/// A walk with a wrong given noise: the calibrated noise predicts held-out fixes better.
TEST(CrossValidate, PrefersTheCalibratedNoise) {
  Walk walk(11, 200);
  walk.given_step_sigma = 3, walk.given_fix_sigma = 0.3;
  walk.build();
  std::vector<std::vector<HeldOutMeasurement>> folds(4);
  for (std::size_t i = 0; i < walk.fixes.rows.size(); ++i) folds[i % 4].push_back({walk.fixes.rows[i].block});
  Problem* const one[] = {&walk.problem};
  const double before = solve(walk.problem, GaussNewtonOptions{}).cost;
  const CrossValidation found = cross_validate(one, {walk.steps, walk.fixes}, folds);
  ASSERT_TRUE(found.complete) << found.why;
  EXPECT_EQ(found.given.size(), 200u);
  EXPECT_GT(found.gain, 3 * found.gain_error);
  int inside = 0;
  for (const auto& p : found.found) inside += p.squared_distance() <= 3.84;
  EXPECT_NEAR(inside / 200.0, 0.95, 0.05);
  EXPECT_NEAR(solve(walk.problem, GaussNewtonOptions{}).cost, before, 1e-9 * before) << "the given noise is restored";
}

TEST(CrossValidate, PredictsFromTheOtherFoldsOnly) {
  Walk walk(12, 5);
  walk.build();
  Problem* const one[] = {&walk.problem};
  const CrossValidation found =
      cross_validate(one, {walk.steps}, {{{walk.fixes.rows[2].block}}, {{walk.fixes.rows[4].block}}});
  ASSERT_TRUE(found.complete) << found.why;
  // The exact density of fix 2 given the other four.
  Eigen::MatrixXd S(5, 5);
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j) S(i, j) = 100 + std::min(i, j) + (i == j ? 1.0 : 0.0);
  const Eigen::MatrixXd information = S.inverse();
  const Eigen::Map<const Eigen::VectorXd> z(walk.z.data(), 5);
  EXPECT_NEAR(found.given[0].covariance(0, 0), 1 / information(2, 2), 1e-6);
  EXPECT_NEAR(std::abs(found.given[0].residual[0]), std::abs((information * z)[2] / information(2, 2)), 1e-6);
}

}  // namespace
}  // namespace tandem::testing
