#include <gtest/gtest.h>

#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/range.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/replanning/damped_sqp.hpp>

namespace tandem::testing {
namespace {

/// Chain of points that are attracted to the origin, and must stay at least 3 m from a pole.
struct Chain {
  Problem problem;
  std::vector<Variable<R3>> points;
  Variable<SE3> pole = problem.add(SE3(), "pole");

  explicit Chain(double away) {
    problem.fix(pole);
    for (int k = 0; k < 8; ++k) {
      points.push_back(problem.add(R3({away, 0.45 * k + 0.02 * k * k, 0.1 * k}), "point " + std::to_string(k)));
      problem.minimize(Prior<R3>{}, Gaussian{1.0, 1.0, 1.0}, {points.back()});
      problem.subject_to(Range<SE3, R3>{3.0}, at_least(0), {pole, points.back()});
    }
  }
};

TEST(DampedSqp, MatchesTheAugmentedLagrangian) {
  Chain chain(3.1), other(3.1);
  DampedSqp sqp(chain.problem);
  const Summary s = sqp.solve({});
  ASSERT_TRUE(s.converged()) << s.message;
  const Summary reference = solve(other.problem, AugmentedLagrangianOptions{});
  ASSERT_TRUE(reference.converged()) << reference.message;
  EXPECT_NEAR(s.cost, reference.cost, 1e-4 * reference.cost);
  EXPECT_LE(s.max_violation, 5e-7);
  for (const auto& x : chain.points) EXPECT_GE(chain.problem.value(x).vector().norm(), 3.0 - 5e-7);
}

TEST(DampedSqp, SolvesAgainFromOtherValues) {
  Chain chain(3.1);
  DampedSqp sqp(chain.problem);
  const Summary first = sqp.solve({});
  for (const auto& x : chain.points) chain.problem.set_value(x, R3(Vector<3>(chain.problem.value(x).vector() * 1.05)));
  const Summary second = sqp.solve({});
  EXPECT_TRUE(first.converged() && second.converged()) << second.message;
  EXPECT_NEAR(first.cost, second.cost, 1e-4 * first.cost);
}

/// From the multipliers of a solution, the curvature of the constraints is known in the first step.
TEST(DampedSqp, StartsFromMultipliers) {
  const auto iterations = [](bool from_multipliers) {
    Chain chain(3.1);
    DampedSqp sqp(chain.problem);
    DampedSqp::Options options;
    options.cost_tolerance = 1e-8;
    const double cost = sqp.solve(options).cost;
    for (const auto& x : chain.points)
      chain.problem.set_value(x, R3(Vector<3>(chain.problem.value(x).vector() + Vector<3>(0.05, -0.02, 0.03))));
    options.from_multipliers = from_multipliers;
    const Summary again = sqp.solve(options);
    EXPECT_TRUE(again.converged()) << again.message;
    EXPECT_NEAR(again.cost, cost, 1e-6 * cost);
    return again.iterations;
  };
  EXPECT_LT(iterations(true), iterations(false));
}

/// Along the sphere, the Lagrangian has a tenth of the Gauss-Newton curvature. Gauss-Newton steps would be ten times
/// too short.
TEST(DampedSqp, UsesTheCurvatureOfTheConstraints) {
  Problem problem;
  const auto pole = problem.add(SE3(), "pole");
  problem.fix(pole);
  const auto x = problem.add(R3({2.0, 2.2, 0.5}), "x");
  problem.minimize(Prior<R3>{R3({0.3, 0.0, 0.0})}, Gaussian{0.01, 0.01, 0.01}, {x});
  problem.subject_to(Range<SE3, R3>{3.0}, at_least(0), {pole, x});
  DampedSqp sqp(problem);
  DampedSqp::Options options;
  options.cost_tolerance = 1e-6;
  const Summary s = sqp.solve(options);
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_LE(s.iterations, 20);
  EXPECT_LE((problem.value(x).vector() - Vector<3>(3.0, 0.0, 0.0)).norm(), 1e-2);
}

TEST(DampedSqp, ReturnsTheBestFeasiblePointWhenStopped) {
  Problem problem;
  const auto pole = problem.add(SE3(), "pole");
  problem.fix(pole);
  const auto x = problem.add(R3({0.0, 2.9, 0.0}), "x");
  problem.minimize(Prior<R3>{R3({10.0, 0.0, 0.0})}, Gaussian{1.0, 1.0, 1.0}, {x});
  problem.subject_to(Range<SE3, R3>{3.0}, at_most(0), {pole, x});
  DampedSqp sqp(problem);
  DampedSqp::Options options;
  options.max_iterations = 1;  // a tangential step, which leaves the sphere
  const Summary s = sqp.solve(options);
  EXPECT_EQ(s.max_violation, 0.0);
  EXPECT_EQ(problem.value(x).vector(), Vector<3>(0.0, 2.9, 0.0));
  EXPECT_EQ(s.cost, s.initial_cost);
}

TEST(DampedSqp, ReportsLimitsAndFailures) {
  Chain chain(3.1);
  DampedSqp sqp(chain.problem);
  DampedSqp::Options options;
  options.time_limit = 0.0;
  EXPECT_EQ(sqp.solve(options).status, Status::time_limit);
  options = {};
  options.max_iterations = 1;
  EXPECT_EQ(sqp.solve(options).status, Status::max_iterations);
  for (const auto& x : chain.points) chain.problem.set_value(x, R3());  // the range has no derivative at the pole
  EXPECT_EQ(sqp.solve({}).status, Status::failed);
}

/// The range is strongly nonlinear at the initial guess, and full steps overshoot repeatedly.
TEST(DampedSqp, ConvergesFromAPoorInitialGuess) {
  Problem problem;
  const auto pole = problem.add(SE3(), "pole"), other = problem.add(SE3(SO3(), {0.2, 0.0, 0.0}), "other");
  problem.fix(pole);
  problem.fix(other);
  const auto x = problem.add(R3({0.1, 1e-2, 0.0}), "x");
  problem.minimize(Prior<R3>{R3({0.0, 0.0, 1.0})}, Gaussian{1.0, 1.0, 1.0}, {x});
  problem.subject_to(Range<SE3, R3>{5.0}, equal_to(0), {pole, x});
  problem.subject_to(Range<SE3, R3>{5.0}, equal_to(0), {other, x});
  DampedSqp sqp(problem);
  DampedSqp::Options options;
  options.max_iterations = 100;
  const Summary s = sqp.solve(options);
  ASSERT_TRUE(s.converged()) << s.message;
  EXPECT_LE(s.max_violation, options.feasible);
  EXPECT_NEAR(problem.value(x).vector()[0], 0.1, 1e-6);
  EXPECT_NEAR(problem.value(x).vector()[2], std::sqrt(25.0 - 0.01), 1e-2);
}

TEST(DampedSqp, ReportsContradictoryConstraints) {
  Problem problem;
  const auto pole = problem.add(SE3(), "pole"), other = problem.add(SE3(SO3(), {10.0, 0.0, 0.0}), "other");
  problem.fix(pole);
  problem.fix(other);
  const auto x = problem.add(R3({2.0, 2.0, 0.5}), "x");
  problem.minimize(Prior<R3>{}, Gaussian{1.0, 1.0, 1.0}, {x});
  problem.subject_to(Range<SE3, R3>{3.0}, at_most(0), {pole, x});
  problem.subject_to(Range<SE3, R3>{3.0}, at_most(0), {other, x});
  DampedSqp sqp(problem);
  DampedSqp::Options options;
  options.max_iterations = 200;
  const Summary s = sqp.solve(options);
  EXPECT_EQ(s.status, Status::infeasible) << s.message;
  EXPECT_NEAR(s.max_violation, 2.0, 0.1) << "in the middle between both";
  EXPECT_FALSE(s.worst_constraint.empty());
  EXPECT_LE(s.iterations, 100);
}

}  // namespace
}  // namespace tandem::testing
