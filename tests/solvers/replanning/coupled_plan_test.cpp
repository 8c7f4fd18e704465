#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/derivative_testing.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/replanning/planner.hpp>

#include "solvers/replanning/hovering_vehicle.hpp"

namespace tandem::testing {
namespace {

Vector<6> six_of(double linear, double angular) {
  return (Vector<6>() << Vector<3>::Constant(linear), Vector<3>::Constant(angular)).finished();
}
Gaussian gaussian(const Vector<6>& sigma) { return Gaussian(Eigen::VectorXd(sigma)); }

/// Window of eight seconds with a chaser at rest that measures the target's position, and sometimes its pose.
struct Window {
  static constexpr int kPoses = 8;
  Problem problem;
  std::vector<Variable<SE3>> chaser, target;
  Vector<6> noise = six_of(0.05, 0.01);

  Window() {
    Vector<6> twist;
    twist << 0.15, 0.0, 0.0, 0.0, 0.0, 0.02;
    SE3 pose(SO3::Exp({0.0, 0.0, 0.3}), {7.0, 2.0, -8.0});
    const SE3 at(SO3(), {0.0, 0.0, -8.5});
    for (int k = 0; k < kPoses; ++k, pose = pose * SE3::Exp(twist)) {
      const std::string of = " " + std::to_string(k);
      chaser.push_back(problem.add(at, "window's chaser" + of));
      target.push_back(problem.add(pose, "window's target" + of));
      if (k == 0) problem.minimize(Prior<SE3>{at}, gaussian(six_of(1e-2, 1e-2)), {chaser[0]});
      const auto last = std::size_t(k);
      if (k > 0) problem.minimize(RelativePose<>{}, gaussian(six_of(0.02, 1e-3)), {chaser[last - 1], chaser[last]});
      const Vector<3> off(0.1 * std::sin(2.0 * k), 0.1 * std::cos(3.0 * k), 0.05);
      problem.minimize(UsblPosition<>{Vector<3>(at.inverse().act(pose.translation()) + off)}, Gaussian{0.1, 0.1, 0.1},
                       {chaser[last], target[last]});
      if (k % 3 == 0)
        problem.minimize(RelativePose<>{at.inverse() * pose}, gaussian(six_of(0.1, 0.05)),
                         {chaser[last], target[last]});
      if (k > 1)
        problem.minimize(ConstantTwist<SE3>{1.0, 1.0}, gaussian(noise),
                         {target[last - 2], target[last - 1], target[last]});
    }
    EXPECT_TRUE(solve(problem, GaussNewtonOptions{}).converged());
  }

  CoupledEstimate estimate(double share) {
    return {problem, chaser.back(), target[kPoses - 2], target.back(), 1.0, noise, {}, share};
  }
  TargetPrediction prediction(int steps) {
    TargetBelief belief;
    belief.before = problem.value(target[kPoses - 2]);
    belief.now = problem.value(target.back());
    return predict_target(belief, noise, 1.0, steps);
  }
  VehicleState<8> start() {
    VehicleState<8> s;
    s.pose = problem.value(chaser.back());
    return s;
  }
};

PlanOptions to_the_standoff() {
  PlanOptions o;
  o.steps = 12;
  o.goal = SE3(SO3(), {-2.5, 0.0, 0.0});
  o.keep_out = 2.0;
  o.running_position = 3.0;
  o.terminal_position = 0.5;
  return o;
}

const Vector<3> kNoCurrent = Vector<3>::Zero();

double difference(const Plan<8>& a, const Plan<8>& b) {
  double most = 0.0;
  for (std::size_t k = 0; k < a.commands.size(); ++k)
    most = std::max(most, (a.commands[k] - b.commands[k]).cwiseAbs().maxCoeff());
  return most;
}

/// Solves a plan's problem from a plan that DampedSqp found, to the smaller tolerance of Ipopt. From a roll-out, Ipopt
/// may end at another local minimum.
Plan<8> polished(PlanProblem<8>& problem, Window& window, const Plan<8>& guess) {
  problem.set_start(window.start(), kNoCurrent);
  problem.set_target(window.prediction(to_the_standoff().steps));
  problem.set_guess(guess);
  IpoptOptions options;
  options.tolerance = 1e-10;
  options.options = {{"mu_init", "1e-9"}};  // stays near the guess
  const Summary summary = solve(problem.problem(), options);
  EXPECT_TRUE(summary.converged()) << summary.message;
  return problem.plan();
}

Plan<8> coupled_plan(Window& window, double share, const PlannerOptions& options) {
  const auto vehicle = hovering_vehicle();
  const PlanOptions plan = to_the_standoff();
  Planner<8> planner(vehicle, plan, options);
  const PlanResult<8> result =
      planner.replan(window.start(), kNoCurrent, window.prediction(plan.steps), window.estimate(share));
  EXPECT_TRUE(result.accepted()) << result.summary.message;
  EXPECT_TRUE(result.coupled);
  EXPECT_GT(result.summary.seconds, 0.0);
  return result.plan;
}

Plan<8> polished_coupled_plan(Window& window, double share) {
  const Plan<8> guess = coupled_plan(window, share, {});
  PlanProblem<8> problem(hovering_vehicle(), to_the_standoff(), window.estimate(share));
  return polished(problem, window, guess);
}

TEST(CoupledPlan, ConvergesToTheUncoupledPlanForASmallShare) {
  if (!ipopt_available()) GTEST_SKIP() << "this build has no Ipopt";
  const auto vehicle = hovering_vehicle();
  const PlanOptions plan = to_the_standoff();
  Window given;
  Planner<8> planner(vehicle, plan, {});
  PlanProblem<8> problem(vehicle, plan);
  const Plan<8> decoupled =
      polished(problem, given, planner.replan(given.start(), kNoCurrent, given.prediction(plan.steps)).plan);
  Window much, little;
  const double of_much = difference(polished_coupled_plan(much, 1e-2), decoupled);
  const double of_little = difference(polished_coupled_plan(little, 1e-4), decoupled);
  EXPECT_GT(of_much, 1e-3);  // the plan has an effect on the predicted target
  EXPECT_LT(of_little, 0.05 * of_much);
}

/// The measurements affect the plan only through the newest poses, so their exact marginal prior gives the same plan.
TEST(CoupledPlan, EqualsThePlanWithTheMarginalPrior) {
  if (!ipopt_available()) GTEST_SKIP() << "this build has no Ipopt";
  Window window, marginal;
  for (std::size_t k = 0; k + 1 < std::size_t(Window::kPoses); ++k) {
    marginal.problem.marginalize(marginal.chaser[k]);
    if (k + 2 < std::size_t(Window::kPoses)) marginal.problem.marginalize(marginal.target[k]);
  }
  EXPECT_EQ(marginal.problem.num_variables(), 3);
  EXPECT_LE(difference(polished_coupled_plan(window, 1e-4), polished_coupled_plan(marginal, 1e-4)), 1e-4);
}

TEST(CoupledPlan, DampedSqpFindsTheSamePlan) {
  Window window, other;
  PlannerOptions quick;
  const Plan<8> first = coupled_plan(window, 1e-4, quick);
  EXPECT_LE(difference(first, polished_coupled_plan(other, 1e-4)), 0.5);  // N, of 40
}

TEST(CoupledPlan, ShiftsTheLastPlanWithoutTime) {
  const auto vehicle = hovering_vehicle();
  const PlanOptions plan = to_the_standoff();
  Window first, second;
  Planner<8> planner(vehicle, plan);
  ASSERT_TRUE(planner.replan(first.start(), kNoCurrent, first.prediction(plan.steps), first.estimate(1e-4)).coupled);
  planner.set_deadline(0.0);
  const PlanResult<8> result =
      planner.replan(second.start(), kNoCurrent, second.prediction(plan.steps), second.estimate(1e-4));
  EXPECT_EQ(result.origin, PlanOrigin::shifted);
  EXPECT_FALSE(result.coupled);
  EXPECT_EQ(result.summary.status, Status::time_limit);
  EXPECT_NE(&planner.problem().problem(), &second.problem);
}

TEST(CoupledPlan, HasConsistentDerivatives) {
  const auto vehicle = hovering_vehicle();
  PlanOptions plan = to_the_standoff();
  plan.steps = 3;
  for (const bool damped : {false, true}) {
    Window window;
    CoupledEstimate estimate = window.estimate(1e-2);
    if (damped) estimate.time_constants = Vector<6>::Constant(5.0);
    PlanProblem<8> problem(vehicle, plan, estimate);
    problem.set_start(window.start(), kNoCurrent);
    problem.set_target(window.prediction(plan.steps));
    for (const unsigned seed : {1u, 2u}) {
      const DerivativeReport report = check_derivatives(problem.problem(), seed);
      EXPECT_LE(report.relative, 1e-6) << report.text;
    }
  }
}

TEST(CoupledPlan, RejectsAShareOfZero) {
  const auto vehicle = hovering_vehicle();
  Window window;
  EXPECT_THROW(PlanProblem<8>(vehicle, to_the_standoff(), window.estimate(0.0)), Error);
}

}  // namespace
}  // namespace tandem::testing
