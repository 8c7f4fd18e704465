#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/residuals/twist_components.hpp>

#include "cases.hpp"
#include "problem/tracking/simulated_tracking.hpp"

/// Hard constraints that cannot be met: a status and the block at fault, from both solvers for large problems.
namespace tandem::testing {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;

std::vector<AnySolver> solvers() {
  std::vector<AnySolver> all{any_solver("augmented_lagrangian", true, AugmentedLagrangianOptions{})};
  if (ipopt_present()) all.insert(all.end(), {ipopt(Hessian::automatic), ipopt_mumps()});
  return all;
}

class Infeasible : public ::testing::TestWithParam<AnySolver> {
 protected:
  using Surge = TwistComponents<SE3, surge>;
  static TrackingData noisy() {
    Simulation simulation;
    simulation.noise = 1.0;
    return simulation.data();
  }

  TrackingProblem tracking = make_tracking_problem(noisy());
  Variable<SE3> from = pose(tracking.target[3]), to = pose(tracking.target[4]);

  void expect_infeasible(double least) {
    expect_infeasible(tracking.problem, least, HasSubstr("twist components of target 3, target 4"));
  }
  /// Where two blocks share a violation, the least sum of violations may put it all into one of them: Ipopt's does.
  template <class Matcher>
  static void expect_infeasible(Problem& problem, double least, const Matcher& block) {
    const Summary s = GetParam()(problem);
    EXPECT_EQ(s.status, Status::infeasible) << s.message;
    EXPECT_THAT(s.worst_constraint, block);
    EXPECT_GE(s.max_violation, 0.95 * least);
    EXPECT_LE(s.max_violation, 2.1 * least);
  }
};

TEST_P(Infeasible, TwoConstraintsThatContradictEachOther) {
  tracking.problem.subject_to(Surge{1.0}, at_least(2.0), {from, to});
  tracking.problem.subject_to(Surge{1.0}, at_most(1.0), {from, to});
  expect_infeasible(0.5);
}

/// The rows of fixed variables alone are checked once, the others solved for.
TEST_P(Infeasible, AConstraintThatFixedVariablesContradict) {
  tracking.problem.fix(from);
  tracking.problem.fix(to);
  const SE3 a = tracking.problem.value(from), b = tracking.problem.value(to);
  const double surge = (a.inverse() * b).Log()[0];
  tracking.problem.subject_to(Surge{1.0}, at_least(surge + 0.7), {from, to});
  expect_infeasible(0.7);
}

/// Two positions 10 m apart and a third pose that must be near both.
TEST_P(Infeasible, ConstraintsThatFixedVariablesLeaveNoRoomFor) {
  Problem problem;
  const auto here = problem.add(R1(), "here"), there = problem.add(R1(Vector<1>(10.0)), "there");
  const auto x = problem.add(R1(Vector<1>(2.0)), "between");
  problem.minimize(Prior<R1>{R1()}, Gaussian{1.0}, {x});
  problem.fix(here);
  problem.fix(there);
  problem.subject_to(RelativePose<R1>{R1()}, between(-4.0, 4.0), {here, x});
  problem.subject_to(RelativePose<R1>{R1()}, between(-4.0, 4.0), {x, there});
  expect_infeasible(problem, 1.0, AnyOf(HasSubstr("here, between"), HasSubstr("between, there")));
}

INSTANTIATE_TEST_SUITE_P(Solvers, Infeasible, ::testing::ValuesIn(solvers()),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace tandem::testing
