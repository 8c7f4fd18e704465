#include <gtest/gtest.h>

#include <tandem/residuals/gauss_markov.hpp>
#include <tandem/residuals/range_bearing.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/residuals/with_bias.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

TEST(WithBias, AddsTheBias) {
  const RangeBearing<SE2, R2> plain{5.0, Direction<2>(0.1)};
  const WithBias<RangeBearing<SE2, R2>> biased{plain};
  const SE2 chaser(SO2(0.3), {1.0, 2.0});
  const R2 target(Vector<2>(5.0, 4.0));
  Vector<2> r, b(0.5, -0.02), with;
  plain(chaser, target, r);
  biased(chaser, target, Rn<2>(b), with);
  EXPECT_EQ(with, Vector<2>(r + b));
}

TEST(WithBias, HasCorrectJacobians) {
  expect_correct_jacobians_at_random_states(WithBias<UsblPosition<SE3, R3>>{{Vector<3>(1.0, 2.3, 3.0)}}, 3);
  expect_correct_jacobians_at_random_states(WithBias<RelativePose<SE3>>{{SE3::Exp(0.3 * Vector<6>::Ones())}}, 4);
}

TEST(WithBias, FillsRequestedJacobiansOnly) {
  const WithBias<RelativePose<SE2>> biased{{SE2(SO2(0.2), {1.0, 0.5})}};
  Vector<3> r;
  Matrix<3, 3> by_target = Matrix<3, 3>::Zero(), by_bias = Matrix<3, 3>::Zero();
  biased(SE2(), SE2(), Rn<3>(), r, static_cast<Matrix<3, 3>*>(nullptr), &by_target, &by_bias);
  EXPECT_EQ(by_bias, (Matrix<3, 3>::Identity()));
  EXPECT_GT(by_target.norm(), 0.5);
  static_assert(Residual<WithBias<RelativePose<SE2>>> && std::tuple_size_v<WithBias<RelativePose<SE2>>::States> == 3);
}

TEST(GaussMarkov, HasCorrectJacobians) { expect_correct_jacobians_at_random_states(GaussMarkov<3>{0.7}, 5); }

TEST(GaussMarkov, IsStationary) {
  const auto step = GaussMarkov<1>::after(3.0, 20.0);
  EXPECT_DOUBLE_EQ(step.decay, std::exp(-0.15));
  EXPECT_DOUBLE_EQ(step.decay * step.decay + step.noise_scale() * step.noise_scale(), 1.0);
  // Two steps equal one step of twice the time.
  const auto twice = GaussMarkov<1>::after(6.0, 20.0);
  EXPECT_NEAR(step.decay * step.decay, twice.decay, 1e-15);
  EXPECT_NEAR(std::pow(step.decay * step.noise_scale(), 2) + std::pow(step.noise_scale(), 2),
              std::pow(twice.noise_scale(), 2), 1e-15);
}

}  // namespace
}  // namespace tandem::testing
