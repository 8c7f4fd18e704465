#include <type_traits>

#include <gtest/gtest.h>

#include <tandem/solvers/solver.hpp>

#include "cases.hpp"
#include "random_problems.hpp"

namespace tandem::testing {
namespace {

void expect_same(const Summary& a, const Summary& b) {
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.message, b.message);
  EXPECT_EQ(a.cost, b.cost);
  EXPECT_EQ(a.initial_cost, b.initial_cost);
  EXPECT_EQ(a.max_violation, b.max_violation);
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_EQ(a.evaluations, b.evaluations);
}

TEST(Solver, RepeatedSolvesEqualFirstSolves) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    RandomProblem again = random_problem(seed), once = random_problem(seed);
    Solver solver(again.problem);
    for (int k = 0; k < 3; ++k) {
      for (std::size_t i = 0; i < once.x.size(); ++i) {
        const R3 start(Vector<3>(std::sin(double(seed) + double(i)), double(k), -1.0));
        again.problem.set_value(again.x[i], start);
        once.problem.set_value(once.x[i], start);
      }
      expect_same(solver.solve(), solve(once.problem, AugmentedLagrangianOptions{}));
      EXPECT_EQ(again.values(), once.values());
    }
    EXPECT_EQ(solver.analyses(), 1);
  }
}

static_assert(!std::is_move_constructible_v<Solver<>>, "its analysis refers to its options");

TEST(Solver, UsesChangedData) {
  Problem problem;
  const auto x = problem.add(R3());
  const Block fix = problem.minimize(Prior<R3>{R3({1.0, 2.0, 3.0})}, Gaussian{1.0, 1.0, 1.0}, {x});
  const Block bound = problem.subject_to(Prior<R3>{R3()}, at_most(1.5), {x});
  Solver solver(problem);
  const auto expect_at = [&](double a, double b, double c) {
    EXPECT_TRUE(solver.solve().converged());
    EXPECT_LE((problem.value(x).vector() - Vector<3>(a, b, c)).norm(), 1e-7);
  };
  expect_at(1.0, 1.5, 1.5);
  problem.set_residual(fix, Prior<R3>{R3({-1.0, 1.0, 9.0})});
  expect_at(-1.0, 1.0, 1.5);
  problem.set_bounds(bound, Bounds<3>{{0.0, 0.0, 0.0}, {2.0, 0.5, 2.5}});
  expect_at(0.0, 0.5, 2.5);
  problem.set_bounds(bound, between(0.25, 2.5));
  expect_at(0.25, 1.0, 2.5);
  problem.set_bounds(bound, Bounds<3>{{0.0, 0.0, 0.0}, {2.0, 0.5, 2.5}});
  problem.set_residual(bound, Prior<R3>{R3({0.0, 0.0, 1.0})});
  expect_at(0.0, 0.5, 3.5);
  solver.options().from_multipliers = true;
  expect_at(0.0, 0.5, 3.5);
  EXPECT_EQ(solver.analyses(), 1);
  problem.remove(bound);
  expect_at(-1.0, 1.0, 9.0);
  EXPECT_EQ(solver.analyses(), 2);
  problem.fix(x);
  EXPECT_EQ(solver.solve().status, Status::unsupported);
}

/// Solves a problem that changes in between, also in its bounds, and compares each solve with a first one.
template <class Options>
void expect_first_solves(const Options& options, bool hard) {
  const auto build = [&](Problem& problem) {
    const auto x = problem.add(R3()), y = problem.add(R3());
    const Block fix = problem.minimize(Prior<R3>{R3({1.0, 2.0, 3.0})}, Gaussian{1.0, 1.0, 1.0}, {x});
    problem.minimize(RelativePose<R3>{R3({1.0, 0.0, 0.0})}, Gaussian{0.5, 0.5, 0.5}, {x, y});
    if (hard) problem.subject_to(Prior<R3>{R3()}, at_most(1.5), {y});
    return std::tuple(x, y, fix);
  };
  Problem again;
  const auto [x, y, fix] = build(again);
  Solver solver(again, options);
  for (int k = 0; k < 3; ++k) {
    Problem once;
    const auto [x_once, y_once, fix_once] = build(once);
    const R3 z({1.0 + k, 2.0 - k, 0.5 * k});
    again.set_residual(fix, Prior<R3>{z});
    once.set_residual(fix_once, Prior<R3>{z});
    for (const auto& [problem, a, b] : {std::tuple(&again, x, y), std::tuple(&once, x_once, y_once)}) {
      problem->set_value(a, R3({0.1, 0.2, double(k)}));
      problem->set_value(b, R3({0.0, 0.1, 0.2}));
    }
    expect_same(solver.solve(), solve(once, options));
    EXPECT_EQ(again.value(x).vector(), once.value(x_once).vector());
    EXPECT_EQ(again.value(y).vector(), once.value(y_once).vector());
  }
  EXPECT_EQ(solver.analyses(), 1);
  again.remove(fix);
  solver.solve();
  EXPECT_EQ(solver.analyses(), 2);
}

TEST(Solver, TakesEverySolver) {
  expect_first_solves(GaussNewtonOptions{}, false);
  if (ipopt_available()) expect_first_solves(IpoptOptions{}, true);
  if (nlopt_algorithms().empty()) return;
  NloptOptions slsqp;
  slsqp.algorithm = "slsqp";
  expect_first_solves(slsqp, true);
}

TEST(Solver, RejectsInvalidChangesOfBlocks) {
  Problem problem;
  const auto x = problem.add(R3());
  const Block soft = problem.minimize(Prior<R3>{R3()}, Gaussian{1.0, 1.0, 1.0}, {x});
  const Block hard = problem.subject_to(Prior<R3>{R3()}, at_most(1.0), {x});
  EXPECT_THROW(problem.set_residual(soft, SquaredNorm{}), Error);
  EXPECT_THROW(problem.set_bounds(soft, at_most(1.0)), Error);
  EXPECT_THROW(problem.set_bounds(hard, Bounds<1>{Vector<1>(0.0), Vector<1>(1.0)}), Error);
  EXPECT_THROW(problem.set_bounds(hard, Bounds<3>{{0, 0, 2}, {1, 1, 1}}), Error);
  problem.remove(hard);
  EXPECT_THROW(problem.set_residual(hard, Prior<R3>{R3()}), Error);
}

}  // namespace
}  // namespace tandem::testing
