#include <gtest/gtest.h>

#include <tandem/solvers/fixed_lag/active_set_solve.hpp>
#include <tandem/solvers/replanning/damped_sqp.hpp>

#include "cases.hpp"

/// Tests the tolerances of solvers with rows of large terms. ‖x‖² = (10⁶)² in metres is met to about 10⁻⁴ at best.
namespace tandem::testing {
namespace {

constexpr double kRadius = 1e6;

struct OnSphere {
  Problem problem;
  Variable<R3> x = problem.add(R3({kRadius, 0.01 * kRadius, 0.0}));
  OnSphere() {
    problem.minimize(Prior<R3>{R3({kRadius, 0.02 * kRadius, 0.0})}, Gaussian{1.0, 1.0, 1.0}, {x});
    problem.subject_to(SquaredNorm{}, equal_to(kRadius * kRadius), {x});
  }
  /// Expects the closest point of the sphere.
  void expect_solution() const {
    const Vector<3> nearest = kRadius * Vector<3>(1.0, 0.02, 0.0).normalized();
    EXPECT_LE((problem.value(x).vector() - nearest).norm(), 1e-2);
  }
};

TEST(LargeRows, ActiveSetSolveConverges) {
  OnSphere sphere;
  NlpEvaluator nlp(sphere.problem);
  BlockCholesky cholesky(nlp.hessian_pattern());
  detail::ActiveRows rows;
  FixedLagOptions options;
  options.max_iterations = 50;
  options.cost_tolerance = 1e-12;
  detail::ActiveSetSolve solve(nlp, cholesky, rows, options);
  const Summary s = solve.run();
  EXPECT_FALSE(solve.gave_up());
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_EQ(s.worst_constraint, "");
  sphere.expect_solution();
}

TEST(LargeRows, DampedSqpConverges) {
  OnSphere sphere;
  DampedSqp::Options options;
  options.max_iterations = options.patience = 200;
  options.cost_tolerance = 1e-12;
  const Summary s = DampedSqp(sphere.problem).solve(options);
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_EQ(s.worst_constraint, "");
  sphere.expect_solution();
}

}  // namespace
}  // namespace tandem::testing
