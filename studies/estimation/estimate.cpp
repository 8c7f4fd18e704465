#include <algorithm>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/ego_track.hpp>
#include <tandem/solvers/tracking/solve_tracking.hpp>
#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/estimation/turned_detections.hpp>
#include <tandem/studies/navigation/navigated.hpp>

namespace tandem {
namespace {

Summary solve_with(const Solver& solver, bool graduated, TrackingProblem& tracking) {
  return std::visit(
      [&](const auto& options) {
        const std::string reason = why_unsupported(tracking.problem, options);
        if (!reason.empty()) throw Error(reason);
        return solve_tracking(tracking, options, graduated);
      },
      solver);
}

Vector<6> twist_in_space(const Rn<6>& twist) { return twist.vector(); }
Vector<6> twist_in_space(const Rn<3>& twist) {
  const Vector<3>& w = twist.vector();
  return Vector<6>(w[0], w[1], 0, 0, 0, w[2]);
}

/// The measurements as they come out of the same estimate with none held out; none when it does not converge.
std::vector<MeasurementOutcome> outcomes_with_all(Scenario scenario, const TrackingOptions& options,
                                                  const Solver& solver, bool graduated) {
  for (TargetSensor& sensor : scenario.data.sensors)
    for (Measurement& m : sensor.measurements) m.held_out = false;
  TrackingProblem tracking = make_tracking_problem(scenario.data, options);
  if (!solve_with(solver, graduated, tracking).converged()) return {};
  return measurement_outcomes(scenario, tracking);
}

void add_uncertainty(const Scenario& scenario, const Solver& solver, bool graduated, TrackingProblem& tracking,
                     Estimate& result) {
  if (!result.summary.converged()) {
    result.why_no_uncertainty = "the solve did not converge";
    return;
  }
  Uncertainty found;
  try {
    found = uncertainty(tracking, scenario.data);
  } catch (const Error& error) {
    result.why_no_uncertainty = error.what();
    return;
  }
  result.uncertainty = std::move(found.keyframes);
  if (found.held_out.empty()) return;

  const bool robust = std::any_of(result.sensors.begin(), result.sensors.end(),
                                  [](const SensorOutcome& sensor) { return sensor.robust; });
  const std::vector<MeasurementOutcome> all =
      robust ? outcomes_with_all(scenario, result.options, solver, graduated) : std::vector<MeasurementOutcome>();
  for (HeldOut& prediction : found.held_out) {
    const double t = scenario.data.sensors[prediction.sensor].measurements[prediction.index].t;
    Validation& validation = result.held_out.emplace_back(Validation{std::move(prediction), t, {}});
    if (!robust) validation.inlier = true;
    for (const MeasurementOutcome& m : all)
      if (m.sensor == validation.prediction.sensor && m.index == validation.prediction.index)
        validation.inlier = !m.down_weighted();
  }
}

Estimate navigate_and_estimate(const Scenario& scenario, const TrackingOptions& options, const Solver& solver,
                               bool graduated, NavigationOptions navigation) {
  navigation.solver.stop = common(solver).stop;
  NavigatedScenario with_chaser = navigated(scenario, navigation);
  Estimate result = estimate(with_chaser.scenario, options, solver, graduated);
  result.findings = std::move(with_chaser.findings);
  return result;
}

void add_ego(const TrackingData& data, const TrackingProblem& tracking, Estimate& result) {
  if (!data.ego) return;
  const std::vector<EgoSensor>& sensors = data.ego->data.sensors;
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const auto used = std::count_if(tracking.ego_measurements.begin(), tracking.ego_measurements.end(),
                                    [&](const PlacedEgoMeasurement& m) { return m.sensor == i; });
    result.ego_sensors.push_back({sensors[i].name, std::size_t(used), tracking.ego_left_out[i]});
  }
  result.splits = tracking.splits;
  if (tracking.dvl_scale) result.dvl_scale = tracking.problem.value(*tracking.dvl_scale).vector()[0];
}

}  // namespace

Estimate estimate(const Scenario& scenario, const TrackingOptions& options, const Solver& solver, bool graduated,
                  const NavigationOptions& navigation) {
  if (needs_navigation(scenario)) return navigate_and_estimate(scenario, options, solver, graduated, navigation);
  TrackingProblem tracking = make_tracking_problem(scenario.data, options);
  const Problem& problem = tracking.problem;

  Estimate result;
  result.scenario = scenario.name;
  result.options = options;
  result.frame = scenario.frame;
  result.residual_blocks = problem.num_soft_blocks();
  result.hard_blocks = problem.num_hard_blocks();
  result.without_extrinsics = scenario.without_extrinsics;
  result.summary = solve_with(solver, graduated, tracking);
  if (const std::string turned = turned_detections(scenario.data, tracking);
      !result.summary.converged() && !turned.empty() && !options.robust_start)
    result.summary.message += "; " + turned + ": try --robust";

  for (std::size_t k = 0; k < tracking.keyframes.size(); ++k) {
    result.chaser.push_back(tracking.chaser_pose(k));
    result.target.push_back(tracking.target_state(k));
  }
  for (const TwistVariable& twist : tracking.twist)
    result.target_twist.push_back(std::visit([&](const auto& x) { return twist_in_space(problem.value(x)); }, twist));
  result.errors = keyframe_errors(scenario, tracking.keyframes, result.chaser, result.target);
  result.measurements = measurement_outcomes(scenario, tracking);
  result.sensors = sensor_outcomes(scenario, options, tracking, result.measurements);
  add_uncertainty(scenario, solver, graduated, tracking, result);
  add_ego(scenario.data, tracking, result);
  result.keyframes = std::move(tracking.keyframes);
  return result;
}

}  // namespace tandem
