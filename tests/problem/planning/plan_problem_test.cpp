#include <numbers>

#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/derivative_testing.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/problem/planning/plan_problem.hpp>
#include <tandem/residuals/prior.hpp>

#include "residuals/vehicle/some_vehicle.hpp"

namespace tandem::testing {
namespace {

/// Options with every cost and every constraint.
PlanOptions all_options(int steps) {
  PlanOptions o;
  o.steps = steps;
  o.dt = 0.7;
  o.goal = SE3(SO3::Exp({0.0, 0.1, 0.3}), {-8.0, 0.5, 0.2});
  o.twist = Bounds<6>{Vector<6>::Constant(-2.0), Vector<6>::Constant(2.0)};
  o.lowest = -40.0;
  o.highest = -1.0;
  o.max_roll_pitch = 0.5;
  o.information = 0.5;
  o.keep_out = 5.0;
  o.approach = Cone{0.6, SE3(SO3::Exp({0.0, 0.0, std::numbers::pi}), {-1.0, 0.0, 0.0})};
  o.view = Cone{0.7, SE3(SO3(), {0.5, 0.0, 0.1}), {-1.0, 0.0, 0.2}};
  return o;
}

TargetPrediction moving_target(const PlanOptions& o) {
  TargetBelief belief;
  belief.now = SE3(SO3::Exp({0.0, 0.0, 0.4}), {15.0, 4.0, -10.0});
  Vector<6> step;
  step << 0.6, 0.0, 0.02, 0.0, 0.0, 0.03;
  belief.before = belief.now * SE3::Exp(-step);
  belief.covariance = 0.01 * Matrix<12, 12>::Identity();
  return predict_target(belief, Vector<6>::Constant(0.02), o.dt, o.steps);
}

template <int N>
void expect_correct_derivatives() {
  const auto vehicle = some_vehicle<N>();
  const PlanOptions options = all_options(4);
  PlanProblem<N> problem(vehicle, options);
  VehicleState<N> start;
  start.pose = SE3(SO3::Exp({0.05, -0.1, 0.2}), {0.0, 1.0, -12.0});
  start.twist << 0.8, 0.1, -0.05, 0.05, 0.02, 0.1;
  start.actuators = Vector<N>::LinSpaced(-0.2, 0.4);
  problem.set_start(start, {0.2, -0.1, 0.02});
  problem.set_target(moving_target(options));
  const VehicleStep<N> step(vehicle, options.dt);
  Plan<N> guess{{start}, {}};
  for (int k = 0; k < options.steps; ++k) {
    guess.commands.push_back(0.1 * Vector<N>::Ones());
    guess.states.push_back(step(guess.states.back(), guess.commands.back(), {0.2, -0.1, 0.02}));
  }
  problem.set_guess(guess);
  const auto size = problem.problem().size();
  EXPECT_EQ(size.unknowns, 4 * (12 + 2 * N));
  EXPECT_EQ(size.equalities, 4 * (12 + N));
  EXPECT_EQ(size.inequalities, 4 * (N + 6 + 1 + 2 + 3));
  for (const unsigned seed : {1u, 2u, 3u}) {
    const DerivativeReport report = check_derivatives(problem.problem(), seed);
    EXPECT_LE(report.relative, 1e-6) << report.text;
  }
}

TEST(PlanProblem, DerivativesMatchFiniteDifferences) {
  expect_correct_derivatives<3>();
  expect_correct_derivatives<8>();
}

/// Residual whose Jacobian is half of the correct one.
struct Wrong {
  static constexpr std::string_view name = "wrong";
  static constexpr int dim = 3;
  using States = std::tuple<R3>;
  void operator()(const R3& x, Vector<3>& r, Matrix<3, 3>* J = nullptr) const {
    r = x.vector();
    if (J) *J = 0.5 * Matrix<3, 3>::Identity();
  }
};

TEST(CheckDerivatives, NamesWrongDerivative) {
  Problem problem;
  const auto x = problem.add(R3({1.0, 2.0, 3.0}), "x");
  problem.minimize(Wrong{}, Gaussian{1.0, 1.0, 1.0}, {x});
  EXPECT_GE(check_derivatives(problem, 1).relative, 0.5);
  Problem constrained;  // its cost is correct
  const auto y = constrained.add(R3({1.0, 2.0, 3.0}), "y");
  constrained.minimize(Prior<R3>{R3({0.0, 1.0, 0.0})}, Gaussian{1.0, 1.0, 1.0}, {y});
  constrained.subject_to(Wrong{}, at_least(0), {y});
  EXPECT_NE(check_derivatives(constrained, 1).text.find("wrong of y"), std::string::npos);
}

TEST(PlanProblem, ReturnsTheInitialGuess) {
  const auto vehicle = some_vehicle<3>();
  PlanOptions options;
  options.steps = 3;
  PlanProblem<3> problem(vehicle, options);
  VehicleState<3> start;
  start.pose = SE3(SO3(), {1.0, 2.0, -3.0});
  const VehicleStep<3> step(vehicle, options.dt);
  Plan<3> plan{{start}, {}};
  for (int k = 0; k < 3; ++k) {
    plan.commands.push_back(Vector<3>::Constant(0.1 * k));
    plan.states.push_back(step(plan.states.back(), plan.commands.back(), Vector<3>::Zero()));
  }
  problem.set_start(start, Vector<3>::Zero());
  problem.set_guess(plan);
  const Plan<3> returned = problem.plan();
  for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(returned.states[k].twist, plan.states[k].twist);
  EXPECT_EQ(returned.commands[2], plan.commands[2]);

  const Plan<3> later = plan.shifted(step, Vector<3>::Zero());
  EXPECT_EQ(later.states.front().twist, plan.states[1].twist);
  EXPECT_EQ(later.commands.back(), plan.commands.back());
  EXPECT_EQ(later.states.size(), 4u);

  plan.commands.pop_back();
  EXPECT_THROW(problem.set_guess(plan), Error);
  TargetPrediction target = moving_target(options);
  target.pose.pop_back();
  EXPECT_THROW(problem.set_target(target), Error);
}

/// Returns the largest violation of a hard constraint for a chaser at rest at `position`.
double violation_at(PlanProblem<3>& problem, const VehicleModel<3>& vehicle, const Vector<3>& position) {
  VehicleState<3> start;
  start.pose = SE3(SO3(), position);
  const Vector<3> no_current = Vector<3>::Zero();
  problem.set_start(start, no_current);
  const VehicleStep<3> step(vehicle, problem.options().dt);
  Plan<3> still{{start}, {}};
  for (int k = 0; k < problem.options().steps; ++k) {
    still.commands.push_back(Vector<3>::Zero());
    still.states.push_back(step(still.states.back(), still.commands.back(), no_current));
  }
  problem.set_guess(still);
  NlpEvaluator nlp(problem.problem());
  Eigen::VectorXd c(nlp.num_rows());
  nlp.constraints(c);
  return nlp.violation(c).size;
}

/// Target at rest, level and aligned with the world. Seen along x, the keep-out distance is linear in its position.
TargetPrediction resting_target(const PlanOptions& o, const Vector<3>& position, const Vector<6>& sigma) {
  TargetPrediction target;
  for (int k = 0; k <= o.steps; ++k) {
    target.pose.emplace_back(SO3(), position);
    target.twist.push_back(Vector<6>::Zero());
    target.covariance.push_back(Matrix<6, 6>(double(k) * sigma.cwiseAbs2().asDiagonal()));
  }
  return target;
}

VehicleModel<3> weightless() {
  auto vehicle = some_vehicle<3>();
  vehicle.weight = vehicle.buoyancy = 0.0;  // stays in place without thrust
  return vehicle;
}

TEST(PlanProblem, ChanceTightensKeepOutByStandardDeviation) {
  const auto vehicle = weightless();
  PlanOptions o;
  o.steps = 4;
  o.keep_out = 5.0;
  o.goal = SE3(SO3(), {-8.0, 0.0, 0.0});
  const Vector<6> sigma = (Vector<6>() << 0.3, 0.7, 0.9, 0.1, 0.2, 0.4).finished();
  const TargetPrediction target = resting_target(o, {10.0, 0.0, 0.0}, sigma);
  const auto violation = [&](double chance) {
    o.chance = chance;
    PlanProblem<3> problem(vehicle, o);
    problem.set_target(target);
    return violation_at(problem, vehicle, {4.5, 0.0, 0.0});  // 5.5 m from the target
  };
  EXPECT_NEAR(violation(0.0), 0.0, 1e-12);
  // After 4 steps σ along x is 0.3 √4 = 0.6 m. The clearance is 0.5 m, so 2 σ violate it by 0.7 m.
  EXPECT_NEAR(violation(2.0), 5.0 + 2.0 * 0.3 * 2.0 - 5.5, 1e-12);
  EXPECT_NEAR(violation(5.0), 5.0 + 5.0 * 0.3 * 2.0 - 5.5, 1e-12);
}

TEST(PlanProblem, ChanceTightensConesAlongTheirNormal) {
  const auto vehicle = weightless();
  PlanOptions o;
  o.steps = 2;
  o.goal = SE3(SO3(), {-8.0, 0.0, 0.0});
  o.view = Cone{0.5};
  const Vector<6> sigma = (Vector<6>() << 0.3, 0.6, 0.9, 0.0, 0.0, 0.0).finished();
  // Far off the axis the rounding of the cone's apex is negligible. The normal of its surface is (sin α, −cos α, 0).
  const TargetPrediction target = resting_target(o, {10.0, 4.0, 0.0}, sigma);
  o.chance = 3.0;
  PlanProblem<3> problem(vehicle, o);
  problem.set_target(target);
  const double off = std::hypot(4.0, 0.01);
  const double room = 10.0 * std::sin(0.5) - (off - 0.01) * std::cos(0.5);
  const double deviation = std::sqrt(2.0) * std::hypot(0.3 * std::sin(0.5), 0.6 * std::cos(0.5) * 4.0 / off);
  ASSERT_GT(3.0 * deviation, room);
  EXPECT_NEAR(violation_at(problem, vehicle, Vector<3>::Zero()), 3.0 * deviation - room, 1e-12);
}

TEST(PlanProblem, ChanceNeverLoosensConstraints) {
  const auto vehicle = weightless();
  PlanOptions o = all_options(6);
  o.information = 0.0;
  PlanProblem<3> plain(vehicle, o);
  o.chance = 2.0;
  PlanProblem<3> tightened(vehicle, o);
  const TargetPrediction target = moving_target(o);
  plain.set_target(target);
  tightened.set_target(target);
  for (const Vector<3>& position :
       {Vector<3>(0.0, 1.0, -12.0), Vector<3>(11.0, 3.0, -10.0), Vector<3>(30.0, 3.0, -9.0)})
    EXPECT_GE(violation_at(tightened, vehicle, position), violation_at(plain, vehicle, position));
  TargetPrediction without = target;
  without.covariance.clear();
  tightened.set_target(without);
  EXPECT_THROW(violation_at(tightened, vehicle, Vector<3>::Zero()), Error);
}

TEST(PlanOptions, InformationOfFixIsHalfTheLogDeterminant) {
  PlanOptions o;
  o.fix.setConstant(0.1);
  Matrix<6, 6> covariance = Matrix<6, 6>::Zero();
  EXPECT_EQ(information_of_fix(o, covariance), 0.0);
  covariance(0, 0) = 0.03;  // three times the fix's variance
  EXPECT_NEAR(information_of_fix(o, covariance), 0.5 * std::log(4.0), 1e-12);
  const Matrix<6, 6> near = expected_information(o, SE3(), SE3(SO3(), {2.0, 0.0, 0.0}));
  EXPECT_NEAR(near(0, 0), 100.0, 1.0);
  EXPECT_LT(expected_information(o, SE3(), SE3(SO3(), {-2.0, 0.0, 0.0})).norm(), 1e-6);
}

TEST(PlanOptions, CoupledCostWeightDecreasesWithVariance) {
  PlanOptions o;
  o.terminal_position = 0.5;
  Matrix<6, 6> covariance = 0.01 * Matrix<6, 6>::Identity();
  EXPECT_EQ(coupled_cost_weight(o, covariance), 1e-4);
  covariance(1, 1) = 25.0;
  EXPECT_DOUBLE_EQ(coupled_cost_weight(o, covariance), 1e-4 * 0.25 / 25.0);
}

TEST(PlanOptions, WhyImpossibleNamesTheConflict) {
  PlanOptions o = all_options(4);
  EXPECT_EQ(why_invalid(o), "");
  o.keep_out = 9.0;
  EXPECT_EQ(why_invalid(o),
            "the wanted relative pose is 8.01 m from the target, inside the keep-out distance of 9.00 m");
  o = all_options(4);
  o.goal = SE3(SO3::Exp({0.0, 0.0, 2.0}), {-8.0, 0.0, 0.0});
  EXPECT_NE(why_invalid(o).find("outside the field of view"), std::string::npos);
  o.goal = SE3(SO3(), {8.0, 0.0, 0.0});
  EXPECT_NE(why_invalid(o).find("outside the approach cone"), std::string::npos);
  o = all_options(4);
  o.lowest = 0.0;
  EXPECT_NE(why_invalid(o).find("depth"), std::string::npos);
  for (auto member : {&PlanOptions::dt, &PlanOptions::effort, &PlanOptions::terminal_position}) {
    o = all_options(4);
    o.*member = 0.0;
    EXPECT_NE(why_invalid(o), "");
  }
  o = all_options(4);
  o.view->half_angle = 2.0;
  EXPECT_NE(why_invalid(o), "");
  o = all_options(4);
  o.chance = -1.0;
  EXPECT_NE(why_invalid(o), "");
  o = all_options(4);
  o.sight.range_fade = 0.0;
  EXPECT_NE(why_invalid(o), "");
  EXPECT_THROW(PlanProblem<3>(some_vehicle<3>(), o), Error);
  auto impossible = some_vehicle<3>();
  impossible.mass(0, 0) = -1.0;
  EXPECT_THROW(PlanProblem<3>(impossible, all_options(4)), Error);
}

}  // namespace
}  // namespace tandem::testing
