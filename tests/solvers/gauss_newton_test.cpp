#include <gmock/gmock.h>

#include "cases.hpp"
#include "problem/tracking/simulated_tracking.hpp"

namespace tandem::testing {
namespace {

using ::testing::HasSubstr;

TEST(GaussNewton, RejectsHardConstraints) {
  Problem problem;
  const auto x = problem.add(R1(), "x");
  problem.minimize(Prior<R1>{R1()}, Gaussian{1.0}, {x});
  EXPECT_EQ(why_unsupported(problem, GaussNewtonOptions{}), "");
  problem.subject_to(Prior<R1>{R1()}, equal_to(1.0), {x});
  EXPECT_THAT(why_unsupported(problem, GaussNewtonOptions{}), HasSubstr("gauss-newton takes soft residuals only"));
  const Summary s = solve(problem, GaussNewtonOptions{});
  EXPECT_EQ(s.status, Status::unsupported);
  EXPECT_THAT(s.message, HasSubstr("use augmented-lagrangian or ipopt"));
  EXPECT_EQ(s.solver, "gauss-newton");
}

TEST(GaussNewton, AcceptsAProblemWithRemovedConstraints) {
  Problem problem;
  const auto x = problem.add(R1(Vector<1>(2.0)), "x");
  problem.minimize(Prior<R1>{R1()}, Gaussian{1.0}, {x});
  problem.remove(problem.subject_to(Prior<R1>{R1()}, equal_to(1.0), {x}));
  EXPECT_TRUE(solve(problem, GaussNewtonOptions{}).converged());
}

TEST(GaussNewton, SolvesALinearProblemInOneStep) {
  Problem problem;
  const auto x = problem.add(R3({5.0, -3.0, 2.0}));
  problem.minimize(Prior<R3>{R3({1.0, 2.0, 3.0})}, Gaussian{0.1, 0.2, 0.3}, {x});
  GaussNewtonOptions options;
  options.initial_damping = 0.0;
  const Summary s = solve(problem, options);
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_LE(s.iterations, 2);
  EXPECT_LE((problem.value(x).vector() - Vector<3>(1.0, 2.0, 3.0)).norm(), 1e-14);
}

/// Entries of one variable that share no residual are independent, however different their standard deviations are.
TEST(GaussNewton, MovesEntriesOfLargeStandardDeviations) {
  for (const double sigma : {1e6, 1e9, 1e10, 2e10, 1e12}) {
    SCOPED_TRACE(sigma);
    Problem problem;
    const auto x = problem.add(R2());
    problem.minimize(Prior<R2>{R2({1.0, 2 * sigma})}, Gaussian{1.0, sigma}, {x});
    // A constant cost, so that the gain of the second entry is a small part of the whole.
    const auto y = problem.add(R2());
    for (const double at : {-100.0, 100.0}) problem.minimize(Prior<R2>{R2({at, at})}, Gaussian{1.0, 1.0}, {y});
    const Summary s = solve(problem, GaussNewtonOptions{});
    EXPECT_TRUE(s.converged()) << s.message;
    EXPECT_NEAR(problem.value(x).vector()[0], 1.0, 1e-4);
    EXPECT_NEAR(problem.value(x).vector()[1] / sigma, 2.0, 1e-3);
  }
}

TEST(GaussNewton, StaysAtTheSolution) {
  Simulation simulation;
  simulation.noise = 1.0;
  TrackingProblem tracking = make_tracking_problem(simulation.data());
  const Summary first = solve(tracking.problem, GaussNewtonOptions{});
  const Summary second = solve(tracking.problem, GaussNewtonOptions{});
  EXPECT_TRUE(first.converged() && second.converged());
  EXPECT_EQ(second.initial_cost, first.cost);
  EXPECT_NEAR(second.cost, first.cost, 1e-9 * first.cost);
  EXPECT_LE(second.cost, first.cost);
  EXPECT_LE(second.iterations, 3);
}

TEST(GaussNewton, NeverIncreasesTheCost) {
  Simulation simulation;
  simulation.noise = 3.0;
  for (const int pairs : {0, 8}) {
    TrackingProblem tracking = make_tracking_problem(simulation.data(), {.loss = Huber(1.0)});
    GaussNewtonOptions options;
    options.secant_pairs = pairs;
    double last = HUGE_VAL;
    options.progress = [&](const Progress& p) {
      EXPECT_LE(p.cost, last);
      last = p.cost;
    };
    EXPECT_TRUE(solve(tracking.problem, options).converged());
  }
}

/// With large residuals, plain Gauss-Newton converges slowly. Secant pairs accelerate it and lead to the same optimum.
TEST(GaussNewton, SecantPairsDoNotChangeTheOptimum) {
  Simulation simulation;
  simulation.noise = 4.0;
  std::vector<Summary> summaries;
  for (const int pairs : {0, 4, 8}) {
    TrackingProblem tracking = make_tracking_problem(simulation.data());
    GaussNewtonOptions options;
    options.secant_pairs = pairs;
    options.cost_tolerance = 1e-13;
    summaries.push_back(solve(tracking.problem, options));
    EXPECT_TRUE(summaries.back().converged()) << summaries.back().message;
    EXPECT_NEAR(summaries.back().cost, summaries.front().cost, 1e-9 * summaries.front().cost);
  }
}

TEST(GaussNewton, ConvergesWithoutIterationsAtTheMinimum) {
  Problem problem;
  const auto x = problem.add(R3({1.0, 2.0, 3.0}));
  problem.minimize(Prior<R3>{R3({1.0, 2.0, 3.0})}, Gaussian{0.1, 0.2, 0.3}, {x});
  const Summary s = solve(problem, GaussNewtonOptions{});
  EXPECT_TRUE(s.converged());
  EXPECT_EQ(s.iterations, 0);
  EXPECT_EQ(problem.value(x).vector(), Vector<3>(1.0, 2.0, 3.0));
}

}  // namespace
}  // namespace tandem::testing
