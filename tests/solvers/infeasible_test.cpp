#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/residuals/twist_components.hpp>

#include "cases.hpp"
#include "problem/tracking/simulated_tracking.hpp"

/// Tests that solvers for large problems report infeasible constraints and the block at fault.
namespace tandem::testing {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;

/// Residual ‖x − centre‖², with the centre on the x axis.
struct Ball {
  static constexpr std::string_view name = "ball";
  static constexpr int dim = 1;
  using States = std::tuple<R3>;
  double centre;
  void operator()(const R3& p, Vector<1>& r, Matrix<1, 3>* J = nullptr) const {
    const Vector<3> d = p.vector() - centre * Vector<3>::UnitX();
    r[0] = d.squaredNorm();
    if (J) *J = 2.0 * d.transpose();
  }
};

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
  /// If two blocks share a violation, Ipopt's solution may assign all of it to one of them.
  template <class Matcher>
  static void expect_infeasible(Problem& problem, double least, const Matcher& block) {
    const Summary s = GetParam()(problem);
    EXPECT_EQ(s.status, Status::infeasible) << s.message;
    EXPECT_THAT(s.worst_constraint, block);
    EXPECT_GE(s.max_violation, 0.95 * least);
    EXPECT_LE(s.max_violation, 2.1 * least);
  }
};

TEST_P(Infeasible, TwoContradictoryConstraints) {
  tracking.problem.subject_to(Surge{1.0}, at_least(2.0), {from, to});
  tracking.problem.subject_to(Surge{1.0}, at_most(1.0), {from, to});
  expect_infeasible(0.5);
}

/// Constraints on fixed variables only are checked before the solve.
TEST_P(Infeasible, AConstraintOnFixedVariables) {
  tracking.problem.fix(from);
  tracking.problem.fix(to);
  const SE3 a = tracking.problem.value(from), b = tracking.problem.value(to);
  const double surge = (a.inverse() * b).Log()[0];
  tracking.problem.subject_to(Surge{1.0}, at_least(surge + 0.7), {from, to});
  expect_infeasible(0.7);
}

/// Two fixed positions 10 m apart, and a third one that must be within 4 m of both.
TEST_P(Infeasible, ConstraintsBetweenFixedVariables) {
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

/// Two balls of radius 1 m, 5 m apart. Near the line between their centres, no row changes across it to first order.
TEST_P(Infeasible, DisjointBalls) {
  Problem problem;
  const auto x = problem.add(R3({0.0, 0.1, 0.0}), "x");
  problem.minimize(Prior<R3>{R3({1.0, 2.0, 0.0})}, Gaussian{1.0, 1.0, 1.0}, {x});
  problem.subject_to(Ball{0.0}, at_most(1.0), {x});
  problem.subject_to(Ball{5.0}, at_most(1.0), {x});
  expect_infeasible(problem, 5.25, HasSubstr("ball of x"));
  EXPECT_LE((problem.value(x).vector() - Vector<3>(2.5, 0.0, 0.0)).norm(), 0.1);
}

INSTANTIATE_TEST_SUITE_P(Solvers, Infeasible, ::testing::ValuesIn(solvers()),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace tandem::testing
