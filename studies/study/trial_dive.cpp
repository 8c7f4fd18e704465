#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/online/heading_alignment.hpp>
#include <tandem/studies/study/nees.hpp>
#include <tandem/studies/study/trial_consistency.hpp>
#include <tandem/studies/study/trial_dive.hpp>
#include <tandem/studies/study/trial_online.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

bool inside_three_sigma(double error, double variance) { return error * error <= 9 * variance; }

/// Returns the states of the batch estimate.
std::vector<OwnState> batch_states(const SimulatedDive& dive, const NavigationData& data,
                                   const NavigationOptions& options, bool covariances, TrialResult& result) {
  const Navigation navigation = navigate(data, options);
  result.status = name(navigation.summary.status);
  if (!navigation.summary.converged()) result.message = navigation.summary.message;
  result.set("keyframes", double(navigation.states.size()));
  result.set("cost", navigation.summary.cost);
  result.set("iterations", navigation.summary.iterations);
  result.set("solve_s", navigation.seconds);
  if (navigation.dvl_scale) result.set("dvl_scale_error", *navigation.dvl_scale - dive.dvl_scale_error);
  std::vector<OwnState> states;
  for (const auto& [t, state] : navigation.states) states.push_back({t, state});
  if (!covariances || !navigation.summary.converged()) return states;

  NavigationProblem solved = make_navigation_problem(navigation.data, navigation.states, navigation.start, options.ego);
  if (solved.dvl_scale) solved.problem.set_value(*solved.dvl_scale, Rn<1>(Vector<1>(*navigation.dvl_scale)));
  try {
    const Marginals marginals(solved.problem, {}, Stop(options.solver));
    for (std::size_t k = 0; k < states.size(); ++k)
      states[k].covariance = ego_covariance(marginals, solved.keyframes[k]);
    add_own_nis(solved.problem, marginals, navigation.data.sensors, solved.measurements, result);
  } catch (const Error& error) {  // the estimate is still valid
    result.message = fmt::format("no covariances: {}", error.what());
  }
  return states;
}

/// Returns the state of each keyframe when it was the newest one of fixed-lag smoothing. `window`: s.
std::vector<OwnState> newest_own_states(const NavigationData& data, const NavigationOptions& options, double window,
                                        bool covariances, TrialResult& result) {
  OnlineOptions online;
  online.ego = options.ego;
  online.lag.window = window;
  online.lag.stop = options.solver.stop;
  OnlineEstimator estimator(TrackingData(), online_settings(data), online);
  std::vector<OwnState> states;
  UpdateSums sums;
  estimator.on_update = [&](const OnlineUpdate& update) {
    sums.add(update);
    if (!update.new_keyframe) return;
    OwnState& newest = states.emplace_back(OwnState{update.t, estimator.chaser()});
    if (covariances) newest.covariance = ego_covariance(estimator);
  };
  const Stop stop(options.solver);
  replay(data, HUGE_VAL, estimator, stop);
  add_updates(sums, states.size(), stop.reached(), result);
  return states;
}

}  // namespace

SimulatedDive trial_dive(const TrialSettings& settings) {
  SimulatedDive dive = simulate_dive(settings.dive);
  ImuNoise& imu = dive.data.imu->noise;
  for (double* const sigma :
       {&imu.accelerometer, &imu.gyroscope, &imu.accelerometer_bias_walk, &imu.gyroscope_bias_walk})
    *sigma *= settings.own.imu_sigma_factor;
  for (EgoSensor& sensor : dive.data.sensors)
    if (sensor.type == EgoSensorType::dvl) sensor.sigma *= settings.own.dvl_sigma_factor;
  dive.tracking.noise.constant_twist *= settings.twist_sigma_factor;
  dive.tracking.noise.constant_velocity *= settings.twist_sigma_factor;
  for (TargetSensor& sensor : dive.tracking.sensors) sensor.sigma *= settings.usbl_sigma_factor;
  return dive;
}

Scenario dive_scenario(const SimulatedDive& dive, const OwnSensorSettings& own) {
  Scenario scenario;
  scenario.name = "dive";
  scenario.data = dive.tracking;
  NavigationData& data = scenario.navigation.emplace(dive.data);
  if (own.without == "imu") data.imu.reset();
  std::erase_if(data.sensors, [&](const EgoSensor& sensor) { return name(sensor.type) == own.without; });
  for (const auto& [t, state] : dive.truth)
    scenario.truth_chaser.push_back({t, SE3(state.rotation(), state.translation())});
  scenario.truth_target = dive.truth_target;
  return scenario;
}

NavigationOptions dive_navigation(const Study& study, const TrialSettings& settings, const std::atomic<bool>* stop) {
  NavigationOptions options;
  options.ego.dvl_scale = settings.own.dvl_scale;
  options.ego.preintegrated_dvl = settings.own.preintegrated;
  options.ego.loss = settings.loss;
  options.covariance = false;
  options.solver.stop = stop;
  if (study.time_limit > 0) options.solver.time_limit = study.time_limit;
  return options;
}

void add_own_errors(const SimulatedDive& dive, const std::vector<OwnState>& states, TrialResult& result) {
  Moments position, orientation, velocity, in_outage, pose_nees, velocity_nees, bias_nees, inside;
  double worst = 0;
  for (const auto& [t, state, covariance] : states) {
    const auto truth = std::lower_bound(dive.truth.begin(), dive.truth.end(), t - kSameInstant,
                                        [](const Stamped<SE23>& x, double time) { return x.t < time; });
    if (truth == dive.truth.end() || truth->t > t + kSameInstant) continue;
    const SE23& x = truth->value;
    const double error = (state.pose.translation() - x.translation()).norm();
    worst = std::max(worst, error);
    position.add(error);
    orientation.add((x.rotation().inverse() * state.pose.rotation()).Log().norm() * kDegrees);
    velocity.add((state.velocity - x.velocity()).norm());
    for (const auto& [from, to] : dive.dvl_outages)
      if (t >= from && t <= to) in_outage.add(error);
    if (!covariance) continue;
    const Vector<6>& bias = dive.biases[std::size_t(truth - dive.truth.begin())].value;
    const EgoNees squared = nees(x, bias, state, *covariance);
    pose_nees.add(squared.pose);
    velocity_nees.add(squared.velocity);
    if (!covariance->bias.isZero(0)) bias_nees.add(squared.bias);
    const Matrix<3, 3> R = state.pose.rotation().matrix();
    const Matrix<3, 3> S = R * covariance->pose.topLeftCorner<3, 3>() * R.transpose();
    for (int i = 0; i < 3; ++i)
      inside.add(inside_three_sigma(state.pose.translation()[i] - x.translation()[i], S(i, i)));
  }
  result.set_mean("chaser_position_m", position);
  result.set_mean("chaser_outage_position_m", in_outage);
  result.set_mean("chaser_orientation_deg", orientation);
  result.set_mean("chaser_velocity_mps", velocity);
  result.set_mean("nees_chaser", pose_nees);
  result.set_mean("nees_velocity", velocity_nees);
  result.set_mean("nees_bias", bias_nees);
  result.set_mean("chaser_inside_three_sigma", inside);
  if (position.n() > 0) result.set("chaser_worst_m", worst);
}

void run_dive_trial(const Study& study, const TrialSettings& settings, const std::atomic<bool>* stop,
                    TrialResult& result) {
  const SimulatedDive dive = trial_dive(settings);
  const NavigationData data = *dive_scenario(dive, settings.own).navigation;
  const NavigationOptions options = dive_navigation(study, settings, stop);
  const std::vector<OwnState> states =
      settings.window > 0 ? newest_own_states(data, options, settings.window, study.covariances, result)
                          : batch_states(dive, data, options, study.covariances, result);
  add_own_errors(dive, states, result);
}

}  // namespace tandem
