#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/solvers/calibration/log_factors.hpp>

namespace tandem::detail {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(LogFactors, PriorIsNormal) {
  const LogPrior prior{2};
  EXPECT_DOUBLE_EQ(prior.value(3), -9.0 / 8);
  EXPECT_DOUBLE_EQ(prior.slope(3), -3.0 / 4);
  EXPECT_DOUBLE_EQ(prior.information(), 0.25);
  const LogPrior none{0};
  EXPECT_EQ(none.value(3), 0);
  EXPECT_EQ(none.slope(3), 0);
  EXPECT_EQ(none.information(), 0);
}

TEST(LogFactors, IndicesOfFlags) {
  EXPECT_THAT(indices_of({true, false, true}, true), ElementsAre(0, 2));
  EXPECT_THAT(indices_of({true, false, true}, false), ElementsAre(1));
}

/// The updated inverse maps the change of the gradient to the step (secant equation).
TEST(LogFactors, UpdateMeetsTheSecantEquation) {
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(2, 2);
  const Eigen::VectorXd step = Eigen::Vector2d(1, 2), change = Eigen::Vector2d(3, 0.5);
  update_inverse(inverse, step, change, 1e-9);
  EXPECT_TRUE((inverse * change).isApprox(step, 1e-12));
  const Eigen::MatrixXd before = inverse;
  update_inverse(inverse, step, -change, 1e-9);
  EXPECT_EQ(inverse, before) << "no update along a direction of negative curvature";
}

TEST(LogFactors, GridCoversTheFlatRangeWithinTheBounds) {
  CalibratedNoise noise;
  noise.flat_from = std::exp(-1.0);
  noise.flat_to = std::exp(1.0);
  const std::vector<double> grid = profile_grid(noise, 3, -10, 10);
  ASSERT_EQ(grid.size(), 3u);
  EXPECT_NEAR(grid[0], -1.6, 1e-12);
  EXPECT_NEAR(grid[1], 0, 1e-12);
  EXPECT_NEAR(grid[2], 1.6, 1e-12);
  EXPECT_EQ(profile_grid(noise, 3, -1, 1).size(), 1u);
  EXPECT_THAT(profile_grid(noise, 0, -1, 1), IsEmpty());
}

TEST(LogFactors, PosteriorIsNotWiderThanThePrior) {
  const Eigen::MatrixXd curvature = Eigen::Vector2d(100, -5).asDiagonal();
  const Eigen::MatrixXd covariance = regularized_covariance(Eigen::Vector2d(1, 0), 2, curvature);
  EXPECT_NEAR(covariance(0, 0), 0.01, 1e-12);
  EXPECT_NEAR(covariance(1, 1), 4, 1e-12) << "without a prior, no_prior bounds the standard deviation";
}

}  // namespace
}  // namespace tandem::detail
