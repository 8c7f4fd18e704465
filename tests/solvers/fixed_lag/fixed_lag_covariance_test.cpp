#include <tuple>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/gauss_markov.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/residuals/with_bias.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag.hpp>

#include "biased_step.hpp"
#include "seconds_of.hpp"

namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(FixedLag, CovarianceOfAnUnobservableVariableIsLarge) {
  FixedLag lag(seconds_of(2.0));
  const auto x = lag.add(0.0, R3(), "x"), alone = lag.add(1.0, R3(), "alone");
  lag.problem().minimize(Prior<R3>{R3()}, noise(3, 0.5), {x});
  ASSERT_TRUE(lag.update().converged());
  EXPECT_NEAR(lag.covariance(alone)(0, 0), 1e12, 1e6);
  EXPECT_NEAR(lag.covariance(x)(0, 0), 0.25, 1e-9);
  ASSERT_TRUE(lag.relinearize());
  EXPECT_NEAR(lag.covariance(alone)(0, 0), 1e12, 1e6);
}

TEST(FixedLag, CovarianceCoversTheVariablesOfTheLastUpdate) {
  FixedLag lag(seconds_of(2.0));
  auto& problem = lag.problem();
  const auto x = lag.add(0.0, R3(), "x"), y = lag.add(3.0, R3(), "y"), held = lag.add(3.0, R3(), "held");
  problem.fix(held);
  problem.minimize(Prior<R3>{R3()}, noise(3, 0.5), {x});
  problem.minimize(RelativePose<R3>{R3()}, noise(3, 0.5), {x, y});
  problem.minimize(RelativePose<R3>{R3()}, noise(3, 1e3), {held, y});
  lag.update();
  const Matrix<6, 6> S = lag.covariance(held, y);
  EXPECT_EQ(S.topRows(3).norm(), 0.0);
  EXPECT_NEAR(S(3, 3), 0.5, 1e-6);
  EXPECT_THROW(lag.covariance(x), StaleHandleError);
  const auto z = lag.add(4.0, R3(), "z");  // reuses the id of x
  EXPECT_THAT([&] { lag.covariance(y, z); }, ThrowsMessage<Error>(HasSubstr("no covariance of z")));
  lag.remove(z);
  EXPECT_EQ(lag.newest(), 3.0);
  EXPECT_TRUE(lag.update().converged());
  EXPECT_NEAR(lag.covariance(y)(0, 0), 0.5, 1e-6);
}

/// Poses with a start far from the estimate, so that the last step of each update changes the Jacobians.
TEST(FixedLag, TheCovarianceBelongsToTheValues) {
  FixedLag lag(seconds_of(8.0));
  const SE3 step = SE3::Exp({1, 0.2, 0, 0, 0, 0.1});
  const Gaussian noise(Vector<6>(0.3, 0.05, 0.1, 0.02, 0.05, 0.3));
  std::vector<Variable<SE3>> x;
  double last_step = 0;
  for (int k = 0; k < 30; ++k) {
    x.push_back(lag.add(k, k ? lag.problem().value(x.back()) : SE3()));
    if (k == 0) lag.problem().minimize(Prior<SE3>{SE3()}, Gaussian(Vector<6>::Constant(0.1)), {x[0]});
    for (const int back : {1, 3})
      if (k >= back) {
        const SE3 measured = back == 1 ? step : step * step * step * SE3::Exp({0.3, 0, 0.2, 0, 0.1, 0.3});
        lag.problem().minimize(RelativePose<SE3>{measured}, noise, {x[std::size_t(k - back)], x.back()});
      }
    lag.update();
    if (k == 0) continue;
    const auto before = x[x.size() - 2], newest = x.back();
    const Matrix<12, 12> reported = lag.covariance(before, newest);
    const Eigen::MatrixXd linearized =
        lag.linearized_covariance({lag.problem().id(before), lag.problem().id(newest)}, {6, 6});
    ASSERT_TRUE(lag.relinearize());
    const Matrix<12, 12> expected = lag.covariance(before, newest);
    EXPECT_LE((reported - expected).norm(), 1e-6 * expected.norm()) << k;
    last_step = std::max(last_step, (linearized - expected).norm() / expected.norm());
  }
  EXPECT_GT(last_step, 1e-3) << "a last step that matters";
}

/// Extends a covariance by a pose, a point and a chain of biases, with redundant blocks. Compares with relinearize().
TEST(FixedLag, ExtendAddsNewVariables) {
  FixedLag lag(seconds_of(100.0));
  auto& problem = lag.problem();
  const SE3 turned = SE3::Exp((Vector<6>() << 1, 2, 3, 0.3, -0.2, 0.5).finished());
  const auto x = lag.add(0.0, SE3(), "x"), y = lag.add(1.0, turned, "y");
  const auto b0 = problem.add(Rn<3>(), "b0");
  problem.minimize(Prior<SE3>{SE3()}, noise(6, 0.5), {x});
  problem.minimize(RelativePose<SE3>{turned}, noise(6, 0.1), {x, y});
  problem.minimize(Prior<Rn<3>>{Rn<3>()}, noise(3, 2.0), {b0});
  problem.minimize(WithBias<UsblPosition<SE3>>{{Vector<3>(1, 2, 3)}}, noise(3, 0.2), {x, y, b0});
  ASSERT_TRUE(lag.update().converged());
  const Matrix<6, 6> of_y = lag.covariance(y);
  ASSERT_TRUE(lag.extend()) << "no new variables";

  const auto z = lag.add(2.0, turned * turned, "z");
  const auto b1 = problem.add(Rn<3>(), "b1"), b2 = problem.add(Rn<3>(), "b2"), other = problem.add(Rn<3>(), "other"),
             held = problem.add(Rn<3>(), "held");
  problem.fix(held);
  const GaussMarkov<3> step{0.8};
  problem.minimize(step, noise(3, 0.7), {b1, b2});
  EXPECT_FALSE(lag.extend()) << "b1 and b2 have no block with a known variable, and `other` has no block";
  EXPECT_THAT([&] { lag.covariance(b1); }, ThrowsMessage<Error>(HasSubstr("no covariance of b1")));
  problem.minimize(step, noise(3, 0.7), {b0, b1});
  problem.minimize(RelativePose<Rn<3>>{Rn<3>()}, noise(3, 3.0), {held, b1});
  problem.minimize(Prior<Rn<3>>{Rn<3>()}, noise(3, 0.4), {other});
  problem.minimize(RollPitch<SE3>{}, noise(2, 0.2), {z});
  problem.minimize(ConstantTwist<SE3>{1.0, 1.0}, noise(6, 0.3), {x, y, z});
  problem.minimize(WithBias<UsblPosition<SE3>>{{Vector<3>(1, 2, 3)}}, noise(3, 0.9), {x, z, b2});
  problem.minimize(ConstantTwist<SE3>{1.0, 1.0}, noise(6, 2.0), {y, z, z});  // reads a variable twice
  ASSERT_TRUE(lag.extend());
  lag.track(2.0, b0);  // b0 may leave the window from now on, and still has a covariance

  const auto all = [&] {
    return std::tuple(lag.covariance(x, y, z), lag.covariance(z, b0, b2), lag.covariance(b2, b1, held),
                      lag.covariance(y, other));
  };
  const auto extended = all();
  EXPECT_EQ((lag.covariance(y) - of_y).norm(), 0) << "unchanged without new variables";
  ASSERT_TRUE(lag.relinearize());
  const auto whole = all();
  const auto expect_same = [](const auto& a, const auto& b) { EXPECT_LE((a - b).norm(), 1e-6 * b.norm()); };
  [&]<std::size_t... I>(std::index_sequence<I...>) { (expect_same(std::get<I>(extended), std::get<I>(whole)), ...); }
  (std::make_index_sequence<4>());
  EXPECT_GT((lag.covariance(z, b2).topRightCorner<6, 3>()).norm(), 1e-3) << "correlated by the measurement";
}

/// Two positions are unobservable, but their difference is not. Once their values have changed, rounding hides it.
TEST(FixedLag, ExtendFailsForUnobservableDirections) {
  FixedLag lag(seconds_of(100.0));
  auto& problem = lag.problem();
  const auto x = lag.add(0.0, R3(), "x"), y = lag.add(1.0, R3(), "y");
  problem.minimize(Prior<R3>{R3()}, noise(3, 1e4), {x});
  problem.minimize(RelativePose<R3>{R3()}, noise(3, 0.1), {x, y});
  ASSERT_TRUE(lag.update().converged());
  const auto between = problem.add(R3(), "between");
  problem.minimize(BiasedStep{Vector<3>::Zero()}, noise(3, 0.1), {x, y, between});
  EXPECT_FALSE(lag.extend());
  ASSERT_TRUE(lag.relinearize());
  EXPECT_NEAR(lag.covariance(between)(0, 0), 0.02, 1e-4);
}

/// An added variable is removed before any update, and the next one reuses its id.
TEST(FixedLag, ExtendDistinguishesVariablesWithTheSameId) {
  FixedLag lag(seconds_of(100.0));
  auto& problem = lag.problem();
  const auto x = lag.add(0.0, R3(), "x");
  problem.minimize(Prior<R3>{R3()}, noise(3, 0.5), {x});
  ASSERT_TRUE(lag.update().converged());
  const auto y = lag.add(1.0, R3(), "y");
  const Block tie = problem.minimize(RelativePose<R3>{R3()}, noise(3, 1.0), {x, y});
  ASSERT_TRUE(lag.extend());
  EXPECT_NEAR(lag.covariance(y)(0, 0), 1.25, 1e-9);
  const int id = problem.id(y);
  problem.remove(tie);
  lag.remove(y);
  EXPECT_THROW(lag.covariance(y), StaleHandleError);
  const auto z = lag.add(1.0, R3(), "z");
  ASSERT_EQ(problem.id(z), id);
  EXPECT_THAT([&] { lag.covariance(z); }, ThrowsMessage<Error>(HasSubstr("no covariance of z")));
  problem.minimize(RelativePose<R3>{R3()}, noise(3, 2.0), {x, z});
  EXPECT_FALSE(lag.extend()) << "y was removed";
  ASSERT_TRUE(lag.relinearize());
  EXPECT_NEAR(lag.covariance(z)(0, 0), 4.25, 1e-9);
}

/// A new measurement of a known variable has not changed the values yet. The covariance for the next innovation must
/// not contain it.
TEST(FixedLag, ExtendIgnoresNewBlocksOfKnownVariables) {
  FixedLag lag(seconds_of(100.0));
  auto& problem = lag.problem();
  const auto x = lag.add(0.0, R3(), "x"), held = lag.add(0.0, R3(), "held");
  problem.fix(held);
  problem.minimize(Prior<R3>{R3()}, noise(3, 0.5), {x});
  ASSERT_TRUE(lag.update().converged());
  const auto y = lag.add(1.0, R3(), "y");
  problem.minimize(RelativePose<R3>{R3()}, noise(3, 1.0), {x, y});
  ASSERT_TRUE(lag.extend());
  problem.minimize(Prior<R3>{R3()}, noise(3, 0.1), {y});
  const auto bias = problem.add(R3(), "bias");
  problem.minimize(Prior<R3>{R3()}, noise(3, 0.4), {bias});
  ASSERT_TRUE(lag.extend());
  const Matrix<9, 9> S = lag.covariance(y, bias, held);
  EXPECT_NEAR(S(0, 0), 1.25, 1e-9);
  EXPECT_NEAR(S(3, 3), 0.16, 1e-9);
  EXPECT_EQ(S(6, 6), 0);
  problem.fix(held, false);
  EXPECT_FALSE(lag.extend()) << "it was fixed at the last update";
}

}  // namespace
}  // namespace tandem::testing
