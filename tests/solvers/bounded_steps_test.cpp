#include <gtest/gtest.h>

#include <tandem/residuals/soft_bound.hpp>

#include "cases.hpp"
#include "problem/tracking/simulated_tracking.hpp"

namespace tandem::testing {
namespace {

/// A stiff soft bound becomes active only within the step. A model of the cost without it would overshoot repeatedly.
TEST(BoundedSteps, AnticipateSoftBounds) {
  Problem problem;
  std::vector<Variable<R1>> x;
  for (int k = 0; k < 40; ++k) x.push_back(problem.add(R1(Vector<1>(0.0)), "x"));
  for (int k = 0; k < 40; ++k) {
    problem.minimize(Prior<R1>{R1(Vector<1>(1.0 + k))}, Gaussian{1.0}, {x[std::size_t(k)]});
    problem.minimize(SoftBound{Prior<R1>{R1()}, at_most(0.5 + 0.5 * k)}, Gaussian{1e-4}, {x[std::size_t(k)]});
    if (k > 0) problem.minimize(RelativePose<R1>{R1()}, Gaussian{10.0}, {x[std::size_t(k) - 1], x[std::size_t(k)]});
  }
  const Summary s = solve(problem, GaussNewtonOptions{});
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_LE(s.iterations, 4);
  for (int k = 0; k < 40; ++k) EXPECT_NEAR(problem.value(x[std::size_t(k)]).vector()[0], 0.5 + 0.5 * k, 1e-3);
  EXPECT_NEAR(s.cost, NlpEvaluator(problem).cost(), 1e-9 * s.cost);
}

TEST(BoundedSteps, ReportTheCostOfSoftBoundsWithHardConstraints) {
  Simulation simulation;
  simulation.noise = 1.0;
  TrackingData data = simulation.data();
  data.noise.surge = 1e-3;
  const auto cost_with = [&](Role limits) {
    TrackingProblem tracking =
        make_tracking_problem(data, {.non_holonomic = Role::hard, .surge = between(0.0, 0.6), .limits = limits});
    const Summary s = solve(tracking.problem, AugmentedLagrangianOptions{});
    EXPECT_TRUE(s.converged()) << s.message;
    EXPECT_LE(s.max_violation, 1e-6);
    EXPECT_NEAR(s.cost, NlpEvaluator(tracking.problem).cost(), 1e-9 * s.cost);
    return s.cost;
  };
  const double soft = cost_with(Role::soft), hard = cost_with(Role::hard);
  EXPECT_LT(soft, hard);
  EXPECT_GT(soft, 0.95 * hard) << "stiff soft bounds are close to hard ones";
}

}  // namespace
}  // namespace tandem::testing
