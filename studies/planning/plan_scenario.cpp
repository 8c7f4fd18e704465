#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/heading_search/solve_tracking.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/studies/planning/plan_scenario.hpp>

namespace tandem {
namespace {

constexpr double kTwistInterval = 1.0;  // s: averaging interval of twists
constexpr double kRateInterval = 60.0;  // s: averaging interval of sensor rates

/// Returns the odometry and the measurements up to the time `at` [s].
TrackingData data_until(const TrackingData& data, double at) {
  constexpr double kMargin = 1;  // s: the last pose is taken for the end of the recording
  if (!data.odometry.empty() && at > data.odometry.back().t + kMargin)
    throw Error(fmt::format("--at {:g} s is after the odometry, which covers {:g} s to {:g} s", at,
                            data.odometry.front().t, data.odometry.back().t));
  TrackingData past = data;
  std::erase_if(past.odometry, [&](const Stamped<SE3>& pose) { return pose.t > at; });
  if (past.odometry.size() < 2)
    throw Error(fmt::format("--at {:g} s is before the second odometry pose; a plan needs two", at));
  const double last = past.odometry.back().t;
  for (TargetSensor& sensor : past.sensors)
    std::erase_if(sensor.measurements, [&](const Measurement& m) { return m.t > at || sensor.valid_at(m) > last; });
  return past;
}

Vector<6> mean_twist(const std::vector<Stamped<SE3>>& poses) {
  const Stamped<SE3>& now = poses.back();
  auto before = poses.end() - 2;
  while (before != poses.begin() && now.t - before->t < kTwistInterval) --before;
  return (before->value.inverse() * now.value).Log() / (now.t - before->t);
}

/// Returns the last keyframe at least kTwistInterval before the newest one.
std::size_t keyframe_before(const std::vector<Keyframe>& keyframes) {
  std::size_t k = keyframes.size() - 1;
  while (k > 0 && keyframes.back().t - keyframes[k].t < kTwistInterval) --k;
  return k;
}

/// Returns the Jacobian of the two target poses relative to the current chaser pose, in right perturbations. Columns:
/// chaser, `before`, `now`.
Matrix<12, 18> seen_from_chaser(const SE3& chaser, const SE3& before, const SE3& now) {
  Matrix<12, 18> J = Matrix<12, 18>::Zero();
  J.block<6, 6>(0, 0) = -(before.inverse() * chaser).Ad();
  J.block<6, 6>(6, 0) = -(now.inverse() * chaser).Ad();
  J.block<12, 12>(0, 6).setIdentity();
  return J;
}

/// Returns the position and pose sensors with their recent rates. Other sensors are ignored, which makes plans more
/// cautious.
std::vector<ExpectedSensor> expected_sensors(const TrackingData& past, double now) {
  const double over =
      past.odometry.empty() ? kRateInterval : std::clamp(now - past.odometry.front().t, 1.0, kRateInterval);
  std::vector<ExpectedSensor> sensors;
  for (const TargetSensor& sensor : past.sensors) {
    const bool pose = sensor.type == SensorType::pose;
    if (!pose && sensor.type != SensorType::position) continue;
    const auto recent = std::count_if(sensor.measurements.begin(), sensor.measurements.end(),
                                      [&](const Measurement& m) { return sensor.valid_at(m) > now - over; });
    ExpectedSensor expected{double(recent) / over, Vector<3>(sensor.sigma.head<3>()), {}, {}};
    if (pose) expected.rotation = Vector<3>(sensor.sigma.tail<3>());
    sensors.push_back(expected);
  }
  return sensors;
}

/// Predicts the target with the fixes that are expected along these chaser states. Poses are measured within `sight`.
template <int N>
TargetPrediction predict_along(const std::vector<VehicleState<N>>& states, const PlanStart& start,
                               const PlanOptions& options, const TargetPrediction& target) {
  std::vector<ExpectedSensor> sensors = start.sensors;
  for (ExpectedSensor& sensor : sensors)
    if (sensor.rotation) sensor.sight = options.sight;
  return predict_target(start.target, start.target_noise, options.dt, options.steps, start.target_time_constants,
                        expected_fixes(sensors, options.dt, states, target.pose));
}

/// The estimate from which a plan starts.
struct StartEstimate {
  PlanStart start;
  TrackingProblem tracking;
  std::size_t before, now;  ///< keyframe indices of start.target

  Variable<SE3> target(std::size_t k) const { return std::get<Variable<SE3>>(tracking.target[k]); }
  Variable<SE3> chaser() const { return std::get<Variable<SE3>>(tracking.chaser[now]); }
};

template <int N>
PlannedRun plan_with(const VehicleModel<N>& model, const PlanRequest& request, StartEstimate& estimate,
                     PlannedRun run) {
  const PlanStart& start = run.start;
  const PlanOptions& options = request.plan;
  const TargetPrediction target =
      predict_target(start.target, start.target_noise, options.dt, options.steps, start.target_time_constants);
  VehicleState<N> state;
  state.pose = start.chaser;
  state.twist = start.chaser_twist;
  state.actuators = command_for(model, state, request.current, Vector<6>(Vector<6>::Zero()));

  Planner<N> planner(model, options, request.planner);
  const TargetPrediction known =
      options.chance > 0
          ? predict_along<N>(planner.guess(state, request.current, target).states, start, options, target)
          : target;
  const PlanResult<N> result =
      request.coupled ? planner.replan(state, request.current, known,
                                       CoupledEstimate{estimate.tracking.problem, estimate.chaser(),
                                                       estimate.target(estimate.before), estimate.target(estimate.now),
                                                       start.target.dt, start.target_noise, start.target_time_constants,
                                                       coupled_cost_weight(options, target.covariance.back())})
                      : planner.replan(state, request.current, known);
  run.summary = result.summary;
  run.origin = result.origin;
  run.coupled = result.coupled;
  run.max_violation = result.max_violation;
  run.worst_constraint = result.worst_constraint;
  if (result.accepted())
    run.active = planner.active_constraints();
  else if (result.summary.status != Status::time_limit && result.summary.status != Status::unsupported)
    run.conflict = conflicting_limits(model, options, request.planner, state, request.current, known);
  run.discretisation = discretisation_error(model, result.plan, options.dt, request.current);
  const Eigen::Index actuators = Eigen::Index(run.vehicle.actuators.size());
  std::vector<Matrix<6, 6>> fixes;
  for (std::size_t k = 1; k < result.plan.states.size(); ++k)
    fixes.push_back(expected_information(options, result.plan.states[k].pose, target.pose[k]));
  const TargetPrediction seen =
      predict_target(start.target, start.target_noise, options.dt, options.steps, start.target_time_constants, fixes);
  for (std::size_t k = 0; k < result.plan.states.size(); ++k) {
    const VehicleState<N>& s = result.plan.states[k];
    run.instants.push_back(
        {start.t + double(k) * options.dt, s.pose, s.twist, s.actuators.head(actuators),
         k < result.plan.commands.size() ? Eigen::VectorXd(result.plan.commands[k].head(actuators)) : Eigen::VectorXd(),
         target.pose[k], target.covariance[k], seen.covariance[k]});
  }
  return run;
}

StartEstimate estimate_start(const Scenario& scenario, const TrackingOptions& options, double at) {
  if (scenario.data.planar) throw Error("a plan needs a scenario in space; this one is planar (group: SE2)");
  if (scenario.data.odometry.empty())
    throw Error(
        "a plan needs chaser_odometry.tum, which this scenario lacks: run tandem navigate and use its chaser.tum");
  if (options.mode != Mode::A || is_point_model(options.model) || options.model == MotionModel::steady_course ||
      options.model == MotionModel::none)
    throw Error("a plan needs a target pose at every keyframe: use mode A with --model constant-twist or damped-twist");
  const TrackingData past = data_until(scenario.data, at);
  StartEstimate estimate{{}, make_tracking_problem(past, options), 0, 0};
  TrackingProblem& tracking = estimate.tracking;
  PlanStart& start = estimate.start;
  start.summary = solve_tracking(tracking, GaussNewtonOptions{});
  if (!start.summary.converged())
    throw Error(fmt::format("the estimate up to {:g} s did not converge: {}", at, start.summary.message));

  const std::size_t now = tracking.keyframes.size() - 1, before = keyframe_before(tracking.keyframes);
  if (before == now) throw Error(fmt::format("--at {:g} s is before the second keyframe; a plan needs two", at));
  estimate.now = now;
  estimate.before = before;
  const auto pose = [&](std::size_t k) { return estimate.target(k); };
  const auto chaser = estimate.chaser();
  const Problem& problem = tracking.problem;
  start.t = tracking.keyframes[now].t;
  start.chaser = problem.value(chaser);
  start.chaser_twist = mean_twist(past.odometry);
  start.target.before = problem.value(pose(before));
  start.target.now = problem.value(pose(now));
  start.target.dt = start.t - tracking.keyframes[before].t;
  const std::array ids{problem.id(chaser), problem.id(pose(before)), problem.id(pose(now))};
  const std::array dofs{6, 6, 6};
  const Marginals marginals(tracking.problem);
  marginals.require_regular();
  start.target.covariance =
      marginals.propagated(seen_from_chaser(start.chaser, start.target.before, start.target.now), ids, dofs);
  const TrackingNoise& noise = past.noise;
  const bool damped = options.model == MotionModel::damped_twist;
  start.target_noise = damped && !noise.acceleration.isZero(0) ? noise.acceleration : noise.constant_twist;
  if (damped) start.target_time_constants = noise.twist_time;
  start.sensors = expected_sensors(past, start.t);
  return estimate;
}

}  // namespace

PlannedRun plan_scenario(const Scenario& scenario, const TrackingOptions& tracking, const Vehicle& vehicle,
                         const PlanRequest& request) {
  PlannedRun run;
  run.scenario = scenario.name;
  run.frame = scenario.frame;
  run.vehicle = vehicle;
  run.request = request;
  StartEstimate estimate = estimate_start(scenario, tracking, request.at);
  run.start = estimate.start;
  return std::visit([&](const auto& model) { return plan_with(model, request, estimate, std::move(run)); },
                    vehicle.model);
}

MissAtEnd miss_at_end(const PlannedRun& run) {
  const PlannedInstant& end = run.instants.back();
  const SE3& goal = run.request.plan.goal;
  const SE3 off = (end.target * goal).inverse() * end.chaser;
  const SE3& before = (run.instants.end() - 2)->target;
  const Vector<6> along = goal.inverse().Ad() * Vector<6>((before.inverse() * end.target).Log() / run.request.plan.dt);
  return {off.translation().norm(), off.rotation().Log().norm(),
          (end.twist.head<3>() - off.rotation().inverse().act(Vector<3>(along.head<3>()))).norm()};
}

}  // namespace tandem
