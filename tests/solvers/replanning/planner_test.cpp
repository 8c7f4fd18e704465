#include <gtest/gtest.h>

#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/replanning/planner.hpp>

#include "solvers/replanning/hovering_vehicle.hpp"

namespace tandem::testing {
namespace {

PlanOptions some_plan(int steps) {
  PlanOptions o;
  o.steps = steps;
  o.goal = SE3(SO3(), {-2.5, 0.0, 0.0});
  o.keep_out = 2.0;
  o.running_position = 3.0;
  o.terminal_position = 0.2;
  o.max_roll_pitch = 0.5;
  o.lowest = -30.0;
  o.highest = -1.0;
  o.view = Cone{0.9};
  return o;
}

TargetPrediction target_at(double t, int steps) {
  Vector<6> twist;
  twist << 0.15, 0.0, 0.0, 0.0, 0.0, 0.02;
  TargetBelief belief;
  belief.now = SE3(SO3::Exp({0.0, 0.0, 0.3}), {7.0, 2.0, -8.0}) * SE3::Exp(t * twist);
  belief.before = belief.now * SE3::Exp(-twist);
  return predict_target(belief, Vector<6>::Constant(0.01), 1.0, steps);
}

VehicleState<8> at_start() {
  VehicleState<8> s;
  s.pose = SE3(SO3(), {0.0, 0.0, -8.5});
  return s;
}

const Vector<3> kCurrent(0.05, -0.1, 0.0);

TEST(Planner, KeepsTheVehicle) {
  const PlanOptions plan = some_plan(4);
  const auto vehicle = hovering_vehicle();
  Planner<8> from_variable(vehicle, plan), from_temporary(hovering_vehicle(), plan);
  const PlanResult<8> a = from_variable.replan(at_start(), kCurrent, target_at(0.0, plan.steps));
  const PlanResult<8> b = from_temporary.replan(at_start(), kCurrent, target_at(0.0, plan.steps));
  EXPECT_EQ(a.summary.cost, b.summary.cost);
  EXPECT_EQ(a.plan.commands.back(), b.plan.commands.back());
}

TEST(Planner, SolversFindTheSamePlan) {
  if (!ipopt_available()) GTEST_SKIP() << "this build has no Ipopt";
  const auto vehicle = hovering_vehicle();
  const PlanOptions plan = some_plan(15);
  double cost[2];
  for (const PlanSolver solver : {PlanSolver::augmented_lagrangian, PlanSolver::ipopt}) {
    PlannerOptions options;
    options.solver = solver;
    Planner<8> planner(vehicle, plan, options);
    const PlanResult<8> result = planner.replan(at_start(), kCurrent, target_at(0.0, plan.steps));
    EXPECT_EQ(result.origin, PlanOrigin::solved) << result.summary.message;
    EXPECT_LE(result.max_violation, kPlanTolerance);
    cost[int(solver)] = result.summary.cost;
    for (const Vector<8>& u : result.plan.commands) {
      EXPECT_TRUE((u.array() <= vehicle.upper.array() + 1e-6).all());
      EXPECT_TRUE((u.array() >= vehicle.lower.array() - 1e-6).all());
    }
  }
  EXPECT_NEAR(cost[0], cost[1], 1e-6 * cost[0]);
}

TEST(Planner, SatisfiesTheDynamicsAndTheKeepOut) {
  const auto vehicle = hovering_vehicle();
  const PlanOptions plan = some_plan(15);
  Planner<8> planner(vehicle, plan);
  const TargetPrediction target = target_at(0.0, plan.steps);
  const PlanResult<8> result = planner.replan(at_start(), kCurrent, target);
  const Plan<8> rolled = result.plan.from(at_start(), planner.step(), kCurrent);
  for (std::size_t k = 0; k < rolled.states.size(); ++k) {
    EXPECT_LE((rolled.states[k].pose.inverse() * result.plan.states[k].pose).Log().norm(), 1e-5) << k;
    EXPECT_GE((rolled.states[k].pose.translation() - target.pose[k].translation()).norm(), 2.0 - 1e-5) << k;
  }
  const SE3 reached = target.pose.back().inverse() * rolled.states.back().pose;
  EXPECT_LE((reached.translation() - plan.goal.translation()).norm(), 0.5);
}

TEST(Planner, ReplansFromTheLastPlan) {
  const auto vehicle = hovering_vehicle();
  const PlanOptions plan = some_plan(15);
  Planner<8> planner(vehicle, plan);
  VehicleState<8> state = at_start();
  for (int k = 0; k < 5; ++k) {
    const PlanResult<8> result = planner.replan(state, kCurrent, target_at(k, plan.steps));
    EXPECT_EQ(result.origin, PlanOrigin::solved) << k << ": " << result.summary.message;
    EXPECT_LE(result.max_violation, kPlanTolerance);
    state = result.plan.states[1];
    state.pose = state.pose * SE3::Exp(Vector<6>::Constant(1e-3));  // disturbance
  }
}

TEST(Planner, TheInitialGuessFollowsThePredictedTarget) {
  const auto vehicle = hovering_vehicle();
  const PlanOptions plan = some_plan(15);
  Planner<8> planner(vehicle, plan);
  const PlanResult<8> first = planner.replan(at_start(), kCurrent, target_at(0.0, plan.steps));
  ASSERT_TRUE(first.accepted()) << first.summary.message;
  const VehicleState<8>& now = first.plan.states[1];
  TargetPrediction target = target_at(1.0, plan.steps);
  const Plan<8> same = planner.guess(now, kCurrent, target);
  for (std::size_t k = 0; k + 1 < first.plan.states.size(); ++k)
    EXPECT_LE((same.states[k].pose.inverse() * first.plan.states[k + 1].pose).Log().norm(), 1e-9) << k;
  const SE3 aside(SO3::Exp({0.0, 0.0, 0.1}), {0.5, -0.4, 0.2});
  for (SE3& pose : target.pose) pose = aside * pose;
  const Plan<8> moved = planner.guess(now, kCurrent, target);
  EXPECT_LE((moved.states.front().pose.inverse() * now.pose).Log().norm(), 1e-12);  // the chaser does not move
  EXPECT_LE((moved.states.back().pose.inverse() * aside * same.states.back().pose).Log().norm(), 1e-9);
}

TEST(Planner, TransfersMultipliersToAnotherProblem) {
  const auto vehicle = hovering_vehicle();
  const PlanOptions plan = some_plan(15);
  Planner<8> planner(vehicle, plan);
  ASSERT_TRUE(planner.replan(at_start(), kCurrent, target_at(0.0, plan.steps)).accepted());
  const std::vector<Eigen::VectorXd> y = planner.problem().multipliers();
  ASSERT_EQ(y.size(), std::size_t(plan.steps));
  EXPECT_GT(y.front().norm(), 0.0);
  PlanProblem<8> other(vehicle, plan);
  other.set_multipliers(y);
  EXPECT_EQ(other.multipliers(), y);
  EXPECT_THROW(other.set_multipliers({}), Error);
}

TEST(Planner, ShiftsTheLastPlanWithoutTime) {
  const auto vehicle = hovering_vehicle();
  const PlanOptions plan = some_plan(10);
  PlannerOptions options;
  Planner<8> planner(vehicle, plan, options);
  const PlanResult<8> first = planner.replan(at_start(), kCurrent, target_at(0.0, plan.steps));
  ASSERT_TRUE(first.accepted()) << first.summary.message;
  planner.set_deadline(0.0);
  VehicleState<8> state = first.plan.states[1];
  state.twist[0] += 0.02;  // the shifted plan then violates the dynamics
  const PlanResult<8> next = planner.replan(state, kCurrent, target_at(1.0, plan.steps));
  EXPECT_EQ(next.origin, PlanOrigin::shifted);
  EXPECT_EQ(next.summary.status, Status::time_limit);
  EXPECT_EQ(next.plan.commands.front(), first.plan.commands[1]);
  EXPECT_TRUE(next.accepted()) << next.worst_constraint;
}

/// A plan that is shifted repeatedly does not reach the goal.
TEST(Planner, StartsFromPursuitAfterThreeShifts) {
  const auto vehicle = hovering_vehicle();
  const PlanOptions plan = some_plan(10);
  Planner<8> planner(vehicle, plan), unplanned(vehicle, plan);
  PlanResult<8> result = planner.replan(at_start(), kCurrent, target_at(0.0, plan.steps));
  ASSERT_TRUE(result.accepted()) << result.summary.message;
  const auto starts_from_pursuit = [&](double t) {
    const VehicleState<8>& state = result.plan.states[1];
    const TargetPrediction target = target_at(t, plan.steps);
    return planner.guess(state, kCurrent, target).commands == unplanned.guess(state, kCurrent, target).commands;
  };
  planner.set_deadline(0.0);
  for (double t = 1.0; t <= 3.0; ++t) {
    EXPECT_FALSE(starts_from_pursuit(t)) << t;
    VehicleState<8> state = result.plan.states[1];
    state.twist[0] += 0.02;
    result = planner.replan(state, kCurrent, target_at(t, plan.steps));
    ASSERT_EQ(result.origin, PlanOrigin::shifted) << t;
  }
  EXPECT_TRUE(starts_from_pursuit(4.0));
  planner.set_deadline(HUGE_VAL);
  result = planner.replan(result.plan.states[1], kCurrent, target_at(4.0, plan.steps));
  EXPECT_EQ(result.origin, PlanOrigin::solved) << result.summary.message;
  EXPECT_FALSE(starts_from_pursuit(5.0));
}

TEST(Planner, SkipsASolverThatHasFailed) {
  if (!ipopt_available()) GTEST_SKIP() << "this build has no Ipopt";
  const auto vehicle = hovering_vehicle();
  const PlanOptions plan = some_plan(10);
  PlannerOptions options;  // neither solver converges with these
  options.max_warm_refinements = 1;
  options.max_warm_iterations = 1;
  Planner<8> planner(vehicle, plan, options);
  PlanResult<8> result = planner.replan(at_start(), kCurrent, target_at(0.0, plan.steps));
  ASSERT_TRUE(result.accepted()) << result.summary.message;
  std::vector<std::string> solvers;
  for (double t = 1.0; t <= 3.0; ++t) {
    VehicleState<8> state = result.plan.states[1];
    state.twist[0] += 0.02;
    result = planner.replan(state, kCurrent, target_at(t, plan.steps));
    ASSERT_EQ(result.origin, PlanOrigin::shifted) << t;
    solvers.push_back(result.summary.solver);
  }
  EXPECT_EQ(solvers, (std::vector<std::string>{"damped-sqp", "ipopt", "damped-sqp"}));
}

/// Returns 3 σ [m] of the target's position at the end of a plan, as predicted with the expected measurements. The
/// chaser starts with a heading of `yaw` relative to the target, and its goal has the same heading.
double three_sigma_at_end(double yaw, double information) {
  const auto vehicle = hovering_vehicle();
  PlanOptions plan = some_plan(15);
  plan.view.reset();
  plan.goal = SE3(SO3::Exp({0.0, 0.0, yaw}), {-2.5, 0.0, 0.0});
  plan.sight.range = 8.0;
  plan.sight.half_angle = 0.5;
  plan.information = information;
  const TargetPrediction target = target_at(0.0, plan.steps);
  TargetBelief belief{target.pose[0] * SE3::Exp(-target.twist[0]), target.pose[0], 1.0, Matrix<12, 12>::Identity()};
  Planner<8> planner(vehicle, plan);
  VehicleState<8> start = at_start();
  start.pose = start.pose * SE3(SO3::Exp({0.0, 0.0, yaw}), Vector<3>::Zero());
  const PlanResult<8> result = planner.replan(start, kCurrent, target);
  EXPECT_TRUE(result.accepted()) << result.summary.message;
  std::vector<Matrix<6, 6>> fixes;
  for (std::size_t k = 1; k < target.pose.size(); ++k)
    fixes.push_back(expected_information(plan, result.plan.states[k].pose, target.pose[k]));
  const TargetPrediction seen = predict_target(belief, Vector<6>::Constant(0.01), 1.0, plan.steps, {}, fixes);
  return 3.0 * std::sqrt(seen.covariance.back().diagonal().head<3>().maxCoeff());
}

/// The chaser must turn away from its goal to see the target. At 2.3 rad, the probability of a measurement has no
/// slope.
TEST(Planner, AnInformationGoalReducesTheUncertainty) {
  for (const double yaw : {1.5, 2.3})
    EXPECT_LT(three_sigma_at_end(yaw, 2.0), 0.3 * three_sigma_at_end(yaw, 0.0)) << yaw;
}

TEST(Planner, ReportsActiveConstraints) {
  const auto vehicle = hovering_vehicle();
  PlanOptions plan = some_plan(15);
  plan.goal = SE3(SO3(), {-2.0, 0.0, 0.0});
  plan.keep_out = 1.99;
  plan.highest = -8.2;  // [m]; the target is higher
  Planner<8> planner(vehicle, plan);
  const PlanResult<8> result = planner.replan(at_start(), kCurrent, target_at(0.0, plan.steps));
  ASSERT_TRUE(result.accepted()) << result.summary.message;
  const std::vector<ActiveConstraint> active = planner.active_constraints();
  ASSERT_FALSE(active.empty());
  bool depth = false;
  for (const ActiveConstraint& a : active)
    if (a.constraint.starts_with("depth")) {
      depth = true;
      EXPECT_NEAR(a.value, -8.2, 1e-5);
      EXPECT_GT(a.multiplier, 0.0);
    }
  EXPECT_TRUE(depth);
}

}  // namespace
}  // namespace tandem::testing
