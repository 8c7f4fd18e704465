#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/quantile.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/problem/tracking/ego_track.hpp>
#include <tandem/problem/tracking/tracking_initial_guess.hpp>
#include <tandem/solvers/heading_search/solve_tracking.hpp>
#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/estimation/estimate_at.hpp>
#include <tandem/studies/estimation/overhead_fixes.hpp>
#include <tandem/studies/estimation/target_constraints.hpp>
#include <tandem/studies/estimation/turned_detections.hpp>
#include <tandem/studies/fit/judged_measurements.hpp>
#include <tandem/studies/navigation/navigated_scenario.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

Summary solve_with(AnySolver solver, bool graduated, const Stop& stop, TrackingProblem& tracking) {
  stop.limit(common(solver));
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

/// Returns the measurement outcomes of a solve without held-out measurements; empty if it does not converge.
std::vector<MeasurementOutcome> outcomes_with_all(Scenario scenario, const TrackingOptions& options,
                                                  const AnySolver& solver, bool graduated, const Stop& stop) {
  for (TargetSensor& sensor : scenario.data.sensors)
    for (Measurement& m : sensor.measurements) m.held_out = false;
  try {
    TrackingProblem tracking = make_tracking_problem(scenario.data, options, stop);
    if (solve_with(solver, graduated, stop, tracking).converged()) return measurement_outcomes(scenario, tracking);
  } catch (const Stopped&) {
  }
  return {};
}

void add_uncertainty(const Scenario& scenario, const AnySolver& solver, bool graduated, const Stop& stop,
                     const JudgedMeasurements& judged, const std::vector<double>& at, TrackingProblem& tracking,
                     Estimate& result) {
  if (!result.summary.converged()) {
    result.why_no_uncertainty = "the solve did not converge";
    return;
  }
  Uncertainty found;
  try {
    std::vector<Marginals::Pair> pairs = pairs_at_keyframes(tracking);
    add_pairs_at(at, tracking, scenario.data, result.options, pairs);
    const Marginals marginals(tracking.problem, pairs, stop);
    found = uncertainty(tracking, scenario.data, marginals, stop);
    result.at = states_at(at, tracking, scenario.data, result.options, &marginals, stop);
    result.fit = fit_report(tracking.problem, judged.sensors, judged.blocks, &marginals, judged.noises);
  } catch (const Error& error) {
    result.why_no_uncertainty = error.what();
    if (dynamic_cast<const Stopped*>(&error)) result.cut_short = error.what();
    return;
  }
  result.uncertainty = std::move(found.keyframes);
  result.constants = std::move(found.constants);
  if (found.held_out.empty()) return;

  const bool robust = std::any_of(result.sensors.begin(), result.sensors.end(),
                                  [](const SensorOutcome& sensor) { return sensor.robust; });
  const std::vector<MeasurementOutcome> all =
      robust ? outcomes_with_all(scenario, result.options, solver, graduated, stop) : std::vector<MeasurementOutcome>();
  if (robust && all.empty() && stop.reached()) {
    result.cut_short = result.why_no_uncertainty =
        "cannot determine which held-out measurements are outliers: the solve with all measurements was stopped early";
  }
  for (HeldOut& prediction : found.held_out) {
    const double t = scenario.data.sensors[prediction.sensor].measurements[prediction.index].t;
    Validation& validation = result.held_out.emplace_back(Validation{std::move(prediction), t, {}});
    if (!robust) validation.inlier = true;
    for (const MeasurementOutcome& m : all)
      if (m.sensor == validation.prediction.sensor && m.index == validation.prediction.index)
        validation.inlier = !m.down_weighted();
  }
}

Estimate navigate_and_estimate(const Scenario& scenario, const TrackingOptions& options, const AnySolver& solver,
                               bool graduated, NavigationOptions navigation, bool covariance,
                               const std::function<void(const Problem&)>& built, const std::vector<double>& at) {
  const Stop stop(common(solver));
  stop.limit(navigation.solver);
  NavigatedScenario with_chaser = navigated(scenario, navigation);
  AnySolver limited = solver;
  stop.limit(common(limited));
  Estimate result = estimate(with_chaser.scenario, options, limited, graduated, {}, covariance, built, at);
  result.findings.insert(result.findings.begin(), with_chaser.findings.begin(), with_chaser.findings.end());
  return result;
}

void add_ego(const TrackingData& data, const TrackingProblem& tracking, Estimate& result) {
  if (!data.ego) return;
  const std::vector<EgoSensor>& sensors = data.ego->data.sensors;
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const auto used = std::count_if(tracking.ego_measurements.begin(), tracking.ego_measurements.end(),
                                    [&](const PlacedEgoMeasurement& m) { return m.sensor == i; });
    result.ego_sensors.push_back({sensors[i].name, std::size_t(used), tracking.num_discarded_ego[i]});
  }
  result.splits = tracking.splits;
  if (tracking.dvl_scale) result.dvl_scale = tracking.problem.value(*tracking.dvl_scale).vector()[0];
}

std::vector<SuspectedOutlier> suspects(const TrackingData& data, const TrackingProblem& tracking,
                                       bool robust_initial_guess, const Stop& stop) {
  const std::vector<Outlier> found =
      robust_initial_guess ? tracking.outliers
                           : outliers(data, tracking.keyframes, odometry_at(data.odometry, tracking.keyframes), stop);
  std::vector<SuspectedOutlier> result;
  for (const Outlier& o : found) {
    const TargetSensor& sensor = data.sensors[o.sensor];
    result.push_back({sensor.name, sensor.measurements[o.index].t, o.sigmas});
  }
  return result;
}

/// Solves without the limits on surge and yaw rate. Returns a warning if the solution clearly exceeds them in more than
/// 10 % of the intervals, else an empty string. Throws Stopped if `stop` requests it.
std::string contradiction(const TrackingData& data, TrackingOptions options, const Stop& stop) try {
  constexpr const char* kWhat = "check of the motion limits against the data";
  const TargetConstraints limits{.surge = options.surge, .max_yaw_rate = options.max_yaw_rate};
  if (!limits.surge && !limits.max_yaw_rate) return "";
  stop.check(kWhat);
  options.surge.reset();
  options.max_yaw_rate.reset();
  if (options.non_holonomic == Role::hard) options.non_holonomic = Role::soft;
  if (options.roll_pitch == Role::hard) options.roll_pitch = Role::soft;
  TrackingProblem unlimited = make_tracking_problem(data, options, stop);
  GaussNewtonOptions solver;
  stop.limit(solver);
  const Summary summary = solve(unlimited.problem, solver);
  if (!summary.converged()) stop.check(kWhat);
  if (!summary.converged()) return "";
  const LimitCheck check = count_outside(unlimited, data.noise, limits);
  if (check.outside == 0 || 10 * check.outside < check.intervals) return "";
  return fmt::format(
      "Without its limits ({}), the target would exceed them in {} of {} intervals; check that they fit the data.",
      describe(limits), check.outside, check.intervals);
} catch (const Stopped&) {
  throw;
} catch (const Error&) {  // the problem without hard constraints may lack noise settings or be rank deficient
  return "";
}

/// Returns Estimate::unmeasured_orientation.
std::string unmeasured_orientation(const TrackingData& data, const Estimate& result) {
  const auto measures_it = [&](const TargetSensor& sensor) {
    return !sensor.measurements.empty() &&
           (sensor.type->has(measured::rotation) || !sensor.marker.translation().isZero());
  };
  const bool has_orientation =
      std::any_of(result.target.begin(), result.target.end(), [](const TargetState& x) { return x.rotation; });
  if (!has_orientation || std::any_of(data.sensors.begin(), data.sensors.end(), measures_it)) return "";
  std::vector<double> sigmas;
  for (const KeyframeUncertainty& u : result.uncertainty)
    if (u.target.rows() == 6) sigmas.push_back(std::sqrt(u.target(5, 5)) * kDegrees);
  std::string spread;
  if (!sigmas.empty())
    spread = fmt::format(" (median standard deviation of the heading: {:.3g}°)", detail::median(sigmas));
  return fmt::format(
      "No sensor measures the orientation of the target, so it is a guess from its course{}; --mode B estimates "
      "points.",
      spread);
}

}  // namespace

std::string SuspectedOutlier::text() const {
  return fmt::format("{} at {:.3f} s is {:.3g} standard deviations from where the other measurements put the target",
                     sensor, t, sigmas);
}

Estimate estimate(const Scenario& scenario, const TrackingOptions& options, const AnySolver& solver, bool graduated,
                  const NavigationOptions& navigation, bool covariance,
                  const std::function<void(const Problem&)>& built, const std::vector<double>& at) {
  if (needs_navigation(scenario))
    return navigate_and_estimate(scenario, options, solver, graduated, navigation, covariance, built, at);
  const Stop stop(common(solver));
  TrackingProblem tracking = make_tracking_problem(scenario.data, options, stop.with_grace());
  const Problem& problem = tracking.problem;

  Estimate result;
  result.scenario = scenario.name;
  result.options = options;
  result.frame = scenario.frame;
  result.residual_blocks = problem.num_soft_blocks();
  result.hard_blocks = problem.num_hard_blocks();
  result.without_extrinsics = scenario.without_extrinsics;
  result.findings = scenario.findings;
  if (built) built(problem);
  result.summary = solve_with(solver, graduated, stop, tracking);
  if (const std::string turned = turned_detections(scenario.data, tracking);
      !result.summary.converged() && !turned.empty() && !options.robust_initial_guess)
    result.summary.message += "; " + turned + ", which may be a flipped detection; try --robust";
  if (const std::string overhead = overhead_fix(scenario.data, tracking);
      !result.summary.converged() && !overhead.empty())
    result.summary.message += "; " + overhead + ", where azimuth is undefined; use `type: range_bearing`";

  for (std::size_t k = 0; k < tracking.keyframes.size(); ++k) {
    result.chaser.push_back(tracking.chaser_pose(k));
    result.target.push_back(tracking.target_state(k));
  }
  for (const TwistVariable& twist : tracking.twist)
    result.target_twist.push_back(std::visit([&](const auto& x) { return twist_in_space(problem.value(x)); }, twist));
  result.errors = keyframe_errors(scenario, tracking.keyframes, result.chaser, result.target);
  const bool compared = summarise(result.errors).compared > 0;
  result.missing_truth = missing_truth(scenario, compared);
  if (!compared) result.target_error_in_world = target_error_in_world(scenario, tracking.keyframes, result.target);
  result.measurements = measurement_outcomes(scenario, tracking);
  result.sensors = sensor_outcomes(scenario, options, tracking, result.measurements);
  try {
    result.suspects = suspects(scenario.data, tracking, options.robust_initial_guess, stop.with_grace());
    result.contradiction = contradiction(scenario.data, options, stop);
  } catch (const Stopped& stopped) {
    result.cut_short = stopped.what();
  }
  result.constants = systematic_error_estimates(problem, tracking.constants, nullptr);
  const JudgedMeasurements judged = judged_measurements(scenario, tracking);
  if (covariance)
    add_uncertainty(scenario, solver, graduated, stop, judged, at, tracking, result);
  else
    result.why_no_uncertainty = "not requested";
  result.unmeasured_orientation = unmeasured_orientation(scenario.data, result);
  if (result.uncertainty.empty()) result.at = states_at(at, tracking, scenario.data, options, nullptr);
  if (result.fit.sensors.empty())
    result.fit = fit_report(problem, judged.sensors, judged.blocks, nullptr, judged.noises);
  result.causes = likely_causes(scenario, options, result.fit, stop);
  for (SensorFit& sensor : result.fit.sensors) {
    const auto cause = std::find_if(result.causes.begin(), result.causes.end(),
                                    [&](const LikelyCause& c) { return c.sensor == sensor.name; });
    if (cause != result.causes.end() && sensor.misfit().empty()) sensor.likely_mistake = cause->text;
  }
  add_ego(scenario.data, tracking, result);
  result.keyframes = std::move(tracking.keyframes);
  return result;
}

}  // namespace tandem
