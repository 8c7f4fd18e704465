#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/ipopt.hpp>

#include "biased_step.hpp"

namespace tandem::testing {
namespace {

/// Options with which one step solves a linear problem.
GaussNewtonOptions undamped() {
  GaussNewtonOptions options;
  options.initial_damping = 0;
  return options;
}

TEST(MarginalConstraint, EqualitiesDetermineALeavingVariable) {
  Problem problem;
  const auto x = problem.add(R3(Vector<3>(0, 0, 0))), y = problem.add(R3(Vector<3>(1, 0, 0)));
  problem.minimize(Prior<R3>{R3(Vector<3>(4, 5, 6))}, noise(3, 2.0), {x});
  problem.subject_to(RelativePose<R3>{R3(Vector<3>(1, 1, 1))}, equal_to(0), {x, y});
  problem.marginalize(x);
  EXPECT_FALSE(problem.marginal_constraint());
  ASSERT_TRUE(solve(problem, undamped()).converged());
  EXPECT_LE((problem.value(y).vector() - Vector<3>(5, 6, 7)).norm(), 1e-12);
}

TEST(MarginalConstraint, RowsThatRemainBecomeTheMarginalConstraint) {
  Problem problem;
  const auto x = problem.add(R3()), y = problem.add(R3()), z = problem.add(R3());
  problem.minimize(Prior<R3>{R3(Vector<3>(4, 5, 6))}, noise(3, 2.0), {x});
  problem.minimize(RelativePose<R3>{R3()}, noise(3, 1.0), {y, z});
  problem.subject_to(Prior<R3>{R3(Vector<3>(1, 2, 3))}, equal_to(0), {x});
  problem.subject_to(RelativePose<R3>{R3(Vector<3>(1, 1, 1))}, equal_to(0), {x, y});
  problem.subject_to(RelativePose<R3>{R3(Vector<3>(1, 1, 1))}, equal_to(0), {x, y});  // redundant
  problem.marginalize(x);
  ASSERT_TRUE(problem.marginal_constraint());
  EXPECT_EQ(problem.bounds(*problem.marginal_constraint()).lower.size(), 3);
  EXPECT_EQ(problem.num_hard_blocks(), 1);
  Problem copy = problem.copy();
  copy.marginalize(copy.counterpart(y));  // merges the constraint: z is free again, but its prior has y = (2, 3, 4)
  EXPECT_FALSE(copy.marginal_constraint());
  ASSERT_TRUE(solve(copy, undamped()).converged());
  EXPECT_LE((copy.value(copy.counterpart(z)).vector() - Vector<3>(2, 3, 4)).norm(), 1e-12);
  ASSERT_TRUE(solve(problem, AugmentedLagrangianOptions{}).converged());
  EXPECT_LE((problem.value(y).vector() - Vector<3>(2, 3, 4)).norm(), 1e-8);
  NlpEvaluator nlp(problem);
  EXPECT_EQ(nlp.num_rows(), 3);
}

TEST(MarginalConstraint, HasConsistentDerivativesOnPoses) {
  Problem problem;
  const auto x = problem.add(SE3()), y = problem.add(SE3::Exp(Vector<6>(1, 0.2, 0, 0.1, 0, 0.3)));
  problem.minimize(Prior<SE3>{SE3()}, noise(6, 1.0), {y});
  problem.subject_to(Prior<SE3>{SE3()}, equal_to(0), {x});
  problem.subject_to(RelativePose<SE3>{SE3::Exp(Vector<6>(1, 0, 0, 0, 0, 0.2))}, equal_to(0), {x, y});
  problem.marginalize(x);
  ASSERT_TRUE(problem.marginal_constraint());
  Problem far = problem.copy();
  far.set_value(far.counterpart(y), problem.value(y) * SE3::Exp(Vector<6>(0.3, 0.5, -0.2, 0.4, 0.2, -0.5)));
  NlpEvaluator nlp(far);
  Eigen::VectorXd direction(6);
  direction << 0.3, -0.2, 0.5, 0.1, 0.7, -0.4;
  EXPECT_EQ(nlp.check_derivatives(direction).kind, NlpEvaluator::DerivativeCheck::Kind::none);
  const double h = 1e-5;
  Eigen::VectorXd multipliers(6), hessian(nlp.hessian_pattern().nonzeros());
  multipliers << 1, -2, 3, 0.5, -1, 2;
  nlp.reset();
  nlp.exact_hessian(0.0, multipliers, hessian);
  const auto gradient = [&](double step) {
    nlp.move_to(step * direction);
    Eigen::VectorXd values(Eigen::Index(nlp.jacobian_pattern().row.size())), g = Eigen::VectorXd::Zero(6);
    nlp.constraint_jacobian(values);
    for (Eigen::Index k = 0; k < values.size(); ++k)
      g[nlp.jacobian_pattern().column[std::size_t(k)]] +=
          values[k] * multipliers[nlp.jacobian_pattern().row[std::size_t(k)]];
    return g;
  };
  const Eigen::VectorXd expected = (gradient(h) - gradient(-h)) / (2 * h);
  const Eigen::Map<const Eigen::MatrixXd> H(hessian.data(), 6, 6);
  EXPECT_LE((H.selfadjointView<Eigen::Lower>() * direction - expected).norm(), 1e-5);
  if (why_unsupported(far, IpoptOptions{}).empty()) {
    ASSERT_TRUE(solve(far, IpoptOptions{}).converged());
    EXPECT_LE(minus(far.value(far.counterpart(y)), SE3::Exp(Vector<6>(1, 0, 0, 0, 0, 0.2))).norm(), 0.3);
  }
}

}  // namespace
}  // namespace tandem::testing
