#include <gtest/gtest.h>

#include <tandem/problem/derivative_testing.hpp>
#include <tandem/residuals/auto_diff.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/solvers/replanning/damped_sqp.hpp>

#include "cases.hpp"

/// Tests that residuals differentiated by AutoDiff behave like their closed forms in problems and solvers.
namespace tandem::testing {
namespace {

using Turn = TwistComponents<SE3, yaw_rate>;

/// A chain of poses: soft priors and constant twist, and a hard bound on the yaw rate if `hard`. wrap(r) adds a
/// residual as it is or differentiated.
template <class Wrap>
Problem chain(bool hard, const Wrap& wrap) {
  Problem problem;
  std::vector<Variable<SE3>> x;
  for (int k = 0; k < 5; ++k) {
    Vector<6> v;
    v << 1.0 * k, 0.3 * std::sin(k), 0.1 * k, 0.02 * k, -0.03 * k, 0.25 * k + 0.1 * (k % 2);
    x.push_back(problem.add(SE3(), "pose " + std::to_string(k)));
    problem.minimize(wrap(Prior<SE3>{SE3::Exp(v)}), Gaussian{0.1, 0.1, 0.1, 0.05, 0.05, 0.05}, {x.back()}, Huber(3.0));
    if (k >= 2)
      problem.minimize(wrap(ConstantTwist<SE3>{1.0, 1.0}), Gaussian{0.2, 0.2, 0.2, 0.1, 0.1, 0.1},
                       {x[k - 2], x[k - 1], x[k]});
    if (k >= 1 && hard) problem.subject_to(wrap(Turn{1.0}), between(-0.2, 0.2), {x[k - 1], x[k]});
  }
  return problem;
}

const auto closed_form = [](const auto& residual) { return residual; };
const auto differentiated = [](const auto& residual) { return AutoDiff{residual}; };

void expect_same(bool hard, const AnySolver& solver) {
  Problem reference = chain(hard, closed_form), problem = chain(hard, differentiated);
  Problem copy = problem.copy();
  const Summary a = solver(reference), b = solver(problem), c = solver(copy);
  EXPECT_EQ(a.status, b.status) << solver << ": " << b.message;
  EXPECT_NEAR(b.cost, a.cost, 1e-6 * a.cost) << solver;
  EXPECT_LE(b.max_violation, 1e-6) << solver;
  EXPECT_EQ(c.cost, b.cost) << solver << ": a copy";
}

TEST(AutoDiffInSolvers, SoftResidualsEqualTheirClosedForm) {
  for (const AnySolver& solver : main_solvers()) expect_same(false, solver);
}

TEST(AutoDiffInSolvers, HardResidualsEqualTheirClosedForm) {
  for (const AnySolver& solver : hard_solvers()) expect_same(true, solver);
}

TEST(AutoDiffInSolvers, DampedSqpFindsTheSameSolution) {
  Problem reference = chain(true, closed_form), problem = chain(true, differentiated);
  const Summary a = DampedSqp(reference).solve({.cost_tolerance = 1e-9}),
                b = DampedSqp(problem).solve({.cost_tolerance = 1e-9});
  EXPECT_TRUE(b.converged()) << b.message;
  EXPECT_NEAR(b.cost, a.cost, 1e-6 * a.cost);
}

}  // namespace
}  // namespace tandem::testing
