#include <array>
#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include <tandem/solvers/multistart.hpp>

#include "cases.hpp"

/// Tests that a part of a problem finds a better minimum from another start, and is unchanged if there is none.
namespace tandem::testing {
namespace {

/// Residuals r = (x² − 1, (x + 1) / 4) with a global minimum 0 at −1 and a local one near 1.
struct TwoWells {
  static constexpr std::string_view name = "two wells";
  static constexpr int dim = 2;
  using States = std::tuple<R1>;
  void operator()(const R1& p, Vector<2>& r, Matrix<2, 1>* J = nullptr) const {
    const double x = p.vector()[0];
    r << x * x - 1.0, 0.25 * (x + 1.0);
    if (J) *J << 2 * x, 0.25;
  }
};

/// Chain of such residuals with weak relative residuals.
struct Wells {
  Problem problem;
  std::array<Variable<R1>, 3> x;

  Wells() {
    for (auto& v : x) v = problem.add(R1(Vector<1>(0.9)));
    for (auto& v : x) problem.minimize(TwoWells{}, Gaussian{0.1, 0.1}, {v});
    for (std::size_t i = 0; i + 1 < x.size(); ++i)
      problem.minimize(RelativePose<R1>{R1()}, Gaussian{100.0}, {x[i], x[i + 1]});
    solve(problem, GaussNewtonOptions{});
  }
  double at(std::size_t i) const { return problem.value(x[i]).vector()[0]; }
  std::function<void()> from(std::size_t i, double value) {
    return [this, i, value] { problem.set_value(x[i], R1(Vector<1>(value))); };
  }
};

TEST(Multistart, KeepsTheBestResult) {
  Wells wells;
  EXPECT_NEAR(wells.at(1), 1.0, 0.1);
  const double before = cost_of(wells.problem);
  const std::array ids{wells.problem.id(wells.x[1])};
  const std::array starts{wells.from(1, 1.3), wells.from(1, -0.8), wells.from(1, -2.0)};
  const MultistartOutcome outcome = solve_part_from(starts, wells.problem, ids, {.min_gain = 1e-6});
  EXPECT_EQ(outcome.best, 1);
  EXPECT_NEAR(wells.at(1), -1.0, 1e-4);
  EXPECT_NEAR(wells.at(0), 1.0, 0.1);
  EXPECT_GT(outcome.gain, 1.0);
  EXPECT_NEAR(before - cost_of(wells.problem), outcome.gain, 1e-9 * before);
}

TEST(Multistart, KeepsTheOriginalValuesIfNoStartIsBetter) {
  Wells wells;
  wells.from(1, -0.8)();
  solve(wells.problem, GaussNewtonOptions{});
  const double best = wells.at(1);
  const std::array ids{wells.problem.id(wells.x[1])};
  const std::array starts{wells.from(1, 1.3), wells.from(1, -3.0)};
  const MultistartOutcome outcome = solve_part_from(starts, wells.problem, ids, {.min_gain = 1e-6});
  EXPECT_EQ(outcome.best, -1);
  EXPECT_EQ(outcome.gain, 0.0);
  EXPECT_EQ(wells.at(1), best);
}

TEST(Multistart, AbandonsTrialsThatReturnOrAreInterrupted) {
  Wells wells;
  const double first = wells.at(1);
  const std::array ids{wells.problem.id(wells.x[1])};
  const std::array starts{wells.from(1, -0.8)};
  int asked = 0;
  MultistartOptions options;
  options.has_returned = [&] {
    ++asked;
    return std::abs(wells.at(1) + 1.0) < 0.5;  // the problem has the values of the trial
  };
  EXPECT_EQ(solve_part_from(starts, wells.problem, ids, options).best, -1);
  EXPECT_EQ(asked, 1);
  EXPECT_EQ(wells.at(1), first);
  const std::atomic<bool> interrupt = true;
  SolverOptions interrupted, late;
  interrupted.stop = &interrupt;
  late.time_limit = 0;
  for (const SolverOptions& limits : {interrupted, late})
    EXPECT_EQ(solve_part_from(starts, wells.problem, ids, {.stop = Stop(limits)}).iterations, 0);
  EXPECT_EQ(wells.at(1), first);
}

/// From 3, the cost first falls fast. The trial ends in the well at 1, whose cost is 12 above that at −1.
TEST(Multistart, AbandonsSlowTrials) {
  Wells wells;
  wells.from(1, -0.8)();
  solve(wells.problem, GaussNewtonOptions{});
  const std::array ids{wells.problem.id(wells.x[1])};
  const std::array starts{wells.from(1, 3.0)};
  MultistartOptions to_the_end, impatient;
  to_the_end.cost_margin = HUGE_VAL;
  impatient.patience = 1;
  const int all = solve_part_from(starts, wells.problem, ids, to_the_end).iterations;
  EXPECT_LT(solve_part_from(starts, wells.problem, ids, impatient).iterations, all);
}

TEST(Multistart, AppliesHardConstraints) {
  Wells wells;
  wells.problem.subject_to(Prior<R1>{R1()}, at_least(-0.5), {wells.x[1]});
  const std::array ids{wells.problem.id(wells.x[1])};
  const std::array starts{wells.from(1, -0.8)};
  const MultistartOutcome outcome = solve_part_from(starts, wells.problem, ids);
  // At −0.5 the first row is −0.75, and the cost exceeds 12.5, the cost at 1.
  EXPECT_EQ(outcome.best, -1);
  EXPECT_NEAR(wells.at(1), 1.0, 0.1);
}

/// The original values violate the constraint, and cost less than any feasible point.
TEST(Multistart, PrefersFeasibleValues) {
  Wells wells;
  wells.from(1, -0.8)();
  solve(wells.problem, GaussNewtonOptions{});
  wells.problem.subject_to(Prior<R1>{R1()}, at_least(0.5), {wells.x[1]});
  const double infeasible = cost_of(wells.problem);
  const std::array ids{wells.problem.id(wells.x[1])};
  const std::array starts{wells.from(1, 0.8), wells.from(1, 1.3)};
  const MultistartOutcome outcome = solve_part_from(starts, wells.problem, ids, {.min_gain = 1e-6});
  EXPECT_EQ(outcome.best, 0);
  EXPECT_NEAR(wells.at(1), 1.0, 0.1);
  EXPECT_NEAR(infeasible - cost_of(wells.problem), outcome.gain, 1e-6);
  EXPECT_LT(outcome.gain, 0.0);
}

TEST(Multistart, LimitsTheIterationsOfATrial) {
  Wells wells;
  const std::array ids{wells.problem.id(wells.x[1])};
  const std::array starts{wells.from(1, -3.0), wells.from(1, 3.0)};
  MultistartOptions limited;
  limited.cost_margin = HUGE_VAL;
  limited.max_iterations = 1;
  EXPECT_EQ(solve_part_from(starts, wells.problem, ids, limited).iterations, 2);
}

TEST(Multistart, KeepsTheBestValuesAfterAnException) {
  Wells wells;
  const std::array ids{wells.problem.id(wells.x[1])};
  const auto broken = [&] {
    wells.from(1, 7.0)();
    throw std::runtime_error("no such start");
  };
  const std::array<std::function<void()>, 2> starts{wells.from(1, -0.8), broken};
  EXPECT_THROW(solve_part_from(starts, wells.problem, ids, {.min_gain = 1e-6}), std::runtime_error);
  EXPECT_NEAR(wells.at(1), -1.0, 1e-3);

  MultistartOptions options;
  options.has_returned = []() -> bool { throw std::runtime_error("cannot tell"); };
  const std::array<std::function<void()>, 1> other{wells.from(1, 1.3)};
  EXPECT_THROW(solve_part_from(other, wells.problem, ids, options), std::runtime_error);
  EXPECT_NEAR(wells.at(1), -1.0, 1e-3);
}

}  // namespace
}  // namespace tandem::testing
