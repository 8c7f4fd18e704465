#include <algorithm>

#include <gtest/gtest.h>

#include <tandem/residuals/soft_bound.hpp>

#include "mixed_problem.hpp"

namespace tandem::testing {
namespace {

using Surge = TwistComponents<SE3, surge>;
using RollAndYawRate = TwistComponents<SE3, roll_rate | yaw_rate>;

/// The mixed problem with additional soft bounds, some active and some not.
class SoftBoundsTest : public ::testing::Test {
 protected:
  MixedProblem mixed;
  Problem& problem = mixed.problem;
  const MixedVariables& v = mixed.v;
  Block first = problem.minimize(SoftBound{Surge{0.8}, between(-0.2, 0.1)}, Gaussian{0.3}, {v.a, v.b});
  Block second = problem.minimize(SoftBound{RollAndYawRate{0.5}, between(-0.3, 0.2)}, Gaussian{0.2, 0.7}, {v.c, v.b});
  Block third = problem.minimize(SoftBound{Surge{0.5}, at_most(50.0)}, Gaussian{0.1}, {v.b, v.c});
  Eigen::VectorXd delta = random_vector(NlpEvaluator(problem).num_unknowns(), 0.5, 3);

  /// Expects the same cost, gradient and Hessians with the bounds as rows, at a point away from X̄.
  void expect_same_cost(NlpEvaluator& rows) {
    NlpEvaluator whole(problem);
    whole.move_to(delta);
    Eigen::VectorXd g(whole.num_unknowns()), H = hessian_values(whole), exact = H;
    const double cost = whole.linearize(g, H);
    const Eigen::VectorXd hard = random_vector(whole.num_rows(), 2.0, 5);
    whole.exact_hessian(1.0, hard, exact);

    rows.move_to(delta);
    Eigen::VectorXd c(rows.num_rows()), J(Eigen::Index(rows.jacobian_pattern().row.size()));
    Eigen::VectorXd gradient(g.size()), hessian = hessian_values(rows), rows_exact = hessian;
    EXPECT_NEAR(rows.linearize(gradient, hessian) + (rows.constraints(c), rows.cost_of_rows(c)), cost, 1e-12 * cost);
    rows.constraint_jacobian(J);
    Eigen::VectorXd y(c.size()), active(c.size());
    for (Eigen::Index i = 0, k = 0; i < c.size(); ++i) {
      const double w = rows.soft_weights()[i], inside = std::clamp(c[i], rows.lower()[i], rows.upper()[i]);
      y[i] = w > 0 ? w * (c[i] - inside) : hard[k++];
      active[i] = w > 0 && c[i] != inside ? w : 0.0;
    }
    const Eigen::VectorXd of_bounds = (rows.soft_weights().array() > 0).select(y, 0.0);
    EXPECT_LE((gradient + dense_jacobian(rows).transpose() * of_bounds - g).norm(), 1e-12 * g.norm());
    rows.add_constraint_hessian(active, J, hessian);
    EXPECT_LE((hessian - H).norm(), 1e-12 * H.norm());
    rows.exact_hessian(1.0, y, rows_exact);
    rows.add_constraint_hessian(active, J, rows_exact);
    // SoftBound has no closed-form second derivatives, so both are finite differences.
    EXPECT_LE((dense(rows.hessian_pattern(), rows_exact) - dense(whole.hessian_pattern(), exact)).norm(),
              1e-6 * exact.norm());
  }
};

TEST_F(SoftBoundsTest, AsRowsHaveTheSameCost) {
  NlpEvaluator rows(problem, SoftBoundRole::as_rows);
  EXPECT_EQ(rows.num_rows(), NlpEvaluator(problem).num_rows() + 4);
  EXPECT_EQ((rows.soft_weights().array() > 0).count(), 4);
  expect_same_cost(rows);
}

TEST_F(SoftBoundsTest, AreNotHardConstraints) {
  NlpEvaluator rows(problem, SoftBoundRole::as_rows), whole(problem);
  Eigen::VectorXd c(rows.num_rows()), hard(whole.num_rows());
  rows.constraints(c);
  whole.constraints(hard);
  EXPECT_EQ(rows.violation(c).size, whole.violation(hard).size);
  EXPECT_EQ(rows.describe_row(rows.violation(c).row), whole.describe_row(whole.violation(hard).row));
  EXPECT_EQ(rows.describe_row(rows.num_rows() - 1), "twist components of c, b");

  const double cost = rows.cost_of_rows(c);
  for (Eigen::Index i = 0; i < c.size(); ++i)
    if (rows.soft_weights()[i] == 0) c[i] = HUGE_VAL;
  EXPECT_EQ(rows.cost_of_rows(c), cost) << "independent of the hard rows";

  whole.set_multipliers(random_vector(whole.num_rows(), 1.0, 7));
  Eigen::VectorXd y(whole.num_rows()), of_rows(rows.num_rows());
  whole.multipliers(y);
  rows.reset();
  rows.multipliers(of_rows);
  EXPECT_EQ(of_rows.norm(), y.norm());
  EXPECT_TRUE((rows.soft_weights().array() > 0).select(of_rows, 0.0).isZero(0));
  of_rows.setConstant(3.0);
  rows.set_multipliers(of_rows);
  whole.multipliers(y);
  EXPECT_TRUE((y.array() == 3.0).all());
}

TEST_F(SoftBoundsTest, ResetReadsChangedNoiseAndBounds) {
  NlpEvaluator rows(problem, SoftBoundRole::as_rows);
  problem.set_noise(first, Gaussian{0.05});
  problem.set_residual(third, SoftBound{Surge{0.5}, at_most(-1.0)});
  EXPECT_TRUE(rows.is_current());
  rows.reset();
  expect_same_cost(rows);
}

TEST_F(SoftBoundsTest, StayInTheCostWithLossOrCorrelatedNoise) {
  NlpEvaluator rows(problem, SoftBoundRole::as_rows);
  problem.set_loss(first, Huber(1.0));
  EXPECT_FALSE(rows.is_current());
  EXPECT_THROW(rows.reset(), Error);
  NlpEvaluator again(problem, SoftBoundRole::as_rows);
  EXPECT_EQ((again.soft_weights().array() > 0).count(), 2);  // roll and yaw rate
  expect_same_cost(again);
  problem.set_noise(second, Gaussian::covariance(Matrix<2, 2>{{0.3, 0.1}, {0.1, 0.2}}));
  EXPECT_FALSE(again.is_current());
  NlpEvaluator last(problem, SoftBoundRole::as_rows);
  EXPECT_EQ(last.num_rows(), NlpEvaluator(problem).num_rows());
  expect_same_cost(last);
}

TEST_F(SoftBoundsTest, OfFixedVariablesHaveTheSameCost) {
  problem.fix(v.a);
  problem.fix(v.b);
  delta = random_vector(NlpEvaluator(problem).num_unknowns(), 0.5, 3);
  NlpEvaluator rows(problem, SoftBoundRole::as_rows);
  EXPECT_EQ((rows.soft_weights().array() > 0).count(), 4);
  expect_same_cost(rows);
}

}  // namespace
}  // namespace tandem::testing
