#include <gtest/gtest.h>

#include <tandem/residuals/biased.hpp>
#include <tandem/residuals/gauss_markov.hpp>
#include <tandem/residuals/range_bearing.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/usbl_position.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

TEST(Biased, adds_what_is_measured_too_much) {
  const RangeBearing<SE2, R2> plain{5.0, Direction<2>(0.1)};
  const Biased<RangeBearing<SE2, R2>> biased{plain};
  const SE2 chaser(SO2(0.3), {1.0, 2.0});
  const R2 target(Vector<2>(5.0, 4.0));
  Vector<2> r, b(0.5, -0.02), with;
  plain(chaser, target, r);
  biased(chaser, target, Rn<2>(b), with);
  EXPECT_EQ(with, Vector<2>(r + b));
}

TEST(Biased, has_the_right_jacobians) {
  expect_right_jacobians_at_random(Biased<UsblPosition<SE3, R3>>{{Vector<3>(1.0, 2.3, 3.0)}}, 3);
  expect_right_jacobians_at_random(Biased<RelativePose<SE3>>{{SE3::Exp(0.3 * Vector<6>::Ones())}}, 4);
}

TEST(Biased, fills_what_is_asked_for) {
  const Biased<RelativePose<SE2>> biased{{SE2(SO2(0.2), {1.0, 0.5})}};
  Vector<3> r;
  Matrix<3, 3> by_target = Matrix<3, 3>::Zero(), by_bias = Matrix<3, 3>::Zero();
  biased(SE2(), SE2(), Rn<3>(), r, static_cast<Matrix<3, 3>*>(nullptr), &by_target, &by_bias);
  EXPECT_EQ(by_bias, (Matrix<3, 3>::Identity()));
  EXPECT_GT(by_target.norm(), 0.5);
  static_assert(Residual<Biased<RelativePose<SE2>>> && std::tuple_size_v<Biased<RelativePose<SE2>>::States> == 3);
}

TEST(GaussMarkov, has_the_right_jacobians) { expect_right_jacobians_at_random(GaussMarkov<3>{0.7}, 5); }

TEST(GaussMarkov, keeps_its_variance) {
  const auto step = GaussMarkov<1>::after(3.0, 20.0);
  EXPECT_DOUBLE_EQ(step.kept, std::exp(-0.15));
  EXPECT_DOUBLE_EQ(step.kept * step.kept + step.spread() * step.spread(), 1.0);
  // Two steps are one of twice the time.
  const auto twice = GaussMarkov<1>::after(6.0, 20.0);
  EXPECT_NEAR(step.kept * step.kept, twice.kept, 1e-15);
  EXPECT_NEAR(std::pow(step.kept * step.spread(), 2) + std::pow(step.spread(), 2), std::pow(twice.spread(), 2), 1e-15);
}

}  // namespace
}  // namespace tandem::testing
