#include <algorithm>
#include <new>
#include <numbers>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/problem/parallel_tasks.hpp>
#include <tandem/solvers/heading_search/solve_tracking.hpp>
#include <tandem/studies/calibration/calibrate_scenarios.hpp>
#include <tandem/studies/navigation/navigated_scenario.hpp>
#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/simulation/normal_noise.hpp>
#include <tandem/studies/study/trial.hpp>
#include <tandem/studies/study/trial_consistency.hpp>
#include <tandem/studies/study/trial_dive.hpp>
#include <tandem/studies/study/trial_online.hpp>
#include <tandem/studies/study/trial_rendezvous.hpp>
#include <tandem/studies/support/resources.hpp>

namespace tandem {
namespace {

constexpr double kAfterGap = 10.0;              // s: interval after a gap that counts for after_gap_position_m
constexpr double kDisplacementInterval = 60.0;  // s: interval between random displacements of the initial guess
constexpr std::uint32_t kStartStream = 7;       // noise stream, distinct from those of the simulation

Summary solve_trial(const AnySolver& solver, bool graduated, TrackingProblem& tracking) {
  return std::visit(
      [&](const auto& options) {
        if (const std::string reason = why_unsupported(tracking.problem, options); !reason.empty()) throw Error(reason);
        return solve_tracking(tracking, options, graduated);
      },
      solver);
}

/// Returns x displaced by step.head<3>() along the world's axes [m] and rotated by step.tail<3>() about the body's
/// [rad]. In the plane, only the planar components apply.
template <LieGroup T>
T displaced(const T& x, const Vector<6>& step) {
  const Vector<T::point_dim> by = step.head<T::point_dim>();
  if constexpr (std::same_as<T, SE3>) {
    return SE3(x.rotation() * SO3::Exp(step.tail<3>()), x.translation() + by);
  } else if constexpr (std::same_as<T, SE2>) {
    return SE2(x.rotation() * SO2(step[5]), x.translation() + by);
  } else {
    return T(Vector<T::point_dim>(x.vector() + by));
  }
}

/// Disturbs the target's initial guess by random displacements every kDisplacementInterval seconds, linearly
/// interpolated in between. Independent displacements of each keyframe would imply turn rates of more than a revolution
/// between keyframes.
void disturb_start(const TrialSettings& settings, TrackingProblem& tracking) {
  if (settings.start_position == 0 && settings.start_orientation == 0) return;
  NormalNoise noise(settings.docking.seed, kStartStream);
  Vector<6> sigma;
  sigma << Vector<3>::Constant(settings.start_position),
      Vector<3>::Constant(settings.start_orientation * std::numbers::pi / 180);
  Vector<6> from = noise.vector<6>(sigma), to = noise.vector<6>(sigma);
  double begin = tracking.keyframes.front().t;
  for (std::size_t k = 0; k < tracking.target.size(); ++k) {
    for (; tracking.keyframes[k].t > begin + kDisplacementInterval; begin += kDisplacementInterval) {
      from = to;
      to = noise.vector<6>(sigma);
    }
    const Vector<6> step = from + (tracking.keyframes[k].t - begin) / kDisplacementInterval * (to - from);
    const auto displace = [&](const auto& target) {
      if constexpr (!requires { target.speed; })
        tracking.problem.set_value(target, displaced(tracking.problem.value(target), step));
    };
    std::visit(displace, tracking.target[k]);
  }
}

/// Returns the share of the target's poses whose z axis points down; nullopt if the target has no poses.
std::optional<double> share_upside_down(const std::vector<TargetState>& target) {
  double poses = 0, down = 0;
  for (const TargetState& state : target)
    if (state.rotation) {
      ++poses;
      down += state.rotation->matrix()(2, 2) < 0;
    }
  if (poses == 0) return {};
  return down / poses;
}

std::vector<OwnState> own_states(const TrackingProblem& tracking) {
  std::vector<OwnState> states;
  for (const EgoKeyframe& keyframe : tracking.ego) {
    const Problem& problem = tracking.problem;
    states.push_back({keyframe.t, {problem.value(keyframe.pose), problem.value(keyframe.velocity).vector()}});
  }
  return states;
}

std::vector<KeyframeError> batch_errors(const TrialProblem& problem, bool covariances, TrialResult& result) {
  TrackingProblem tracking = make_tracking_problem(problem.scenario.data, problem.options);
  disturb_start(problem.settings, tracking);
  const Summary summary = solve_trial(problem.solver, problem.settings.graduated, tracking);
  result.status = name(summary.status);
  if (!summary.converged()) result.message = summary.message;
  if (!summary.unobservable.empty()) result.message = "unobservable: " + describe(summary.unobservable);
  result.set("keyframes", double(tracking.keyframes.size()));
  result.set("cost", summary.cost);
  result.set("violation", summary.max_violation);
  result.set("iterations", summary.iterations);
  result.set("solve_s", summary.seconds);
  std::vector<SE3> chaser;
  std::vector<TargetState> target;
  for (std::size_t k = 0; k < tracking.keyframes.size(); ++k) {
    chaser.push_back(tracking.chaser_pose(k));
    target.push_back(tracking.target_state(k));
  }
  if (problem.dive) add_own_errors(*problem.dive, own_states(tracking), result);
  result.set("upside_down", share_upside_down(target));
  if (covariances && summary.converged()) try {
      add_consistency(tracking, problem.scenario, result);
    } catch (const Error& error) {  // the estimate is still valid
      if (summary.unobservable.empty()) result.message = fmt::format("no covariances: {}", error.what());
    }
  return keyframe_errors(problem.scenario, tracking.keyframes, chaser, target);
}

/// Replaces the noise by noise calibrated on the trial's measurements, without truth. Parameters that are not
/// identifiable keep their values.
void calibrate_noise(TrialProblem& problem, const std::atomic<bool>* stop) {
  ScenarioCalibrationOptions options;
  options.folds = 0;
  options.target = problem.options;
  options.stop = Stop(stop);
  const ScenarioCalibration found = calibrate_scenarios({problem.scenario}, options);
  for (const NoiseEntry& entry : found.noise)
    for (const NamedNoise& named : named_noise(problem.scenario.data))
      if (named.name == entry.name) std::copy(entry.sigmas.begin(), entry.sigmas.end(), named.sigmas.begin());
}

Scenario make_scenario(SimulatedDocking docking) {
  Scenario scenario;
  scenario.name = "docking";
  scenario.data = std::move(docking.data);
  scenario.truth_chaser = std::move(docking.truth_chaser);
  scenario.truth_target = std::move(docking.truth_target);
  return scenario;
}

}  // namespace

SimulatedDocking trial_docking(const TrialSettings& settings) {
  SimulatedDocking docking = simulate_docking(settings.docking);
  TrackingNoise& noise = docking.data.noise;
  noise.constant_twist *= settings.twist_sigma_factor;
  noise.constant_velocity *= settings.twist_sigma_factor;
  docking.data.sensors[0].sigma *= settings.usbl_sigma_factor;
  docking.data.sensors[1].sigma *= settings.optical_sigma_factor;
  return docking;
}

TrialProblem trial_problem(const Study& study, std::size_t trial, const std::atomic<bool>* stop) {
  const TrialPlace place = study.place(trial);
  TrialProblem problem;
  problem.settings = study.settings(place);
  problem.options = study.model(place).options;
  problem.solver = study.solver(place);
  if (!problem.settings.level && problem.options.roll_pitch == Role::soft) problem.options.roll_pitch = Role::off;
  problem.options.junction = problem.settings.junction;
  problem.options.loss = problem.settings.loss;
  problem.options.max_keyframes = static_cast<std::size_t>(problem.settings.max_keyframes);
  if (study.simulation == Simulated::dive) {
    problem.dive = trial_dive(problem.settings);
    problem.scenario =
        navigated(dive_scenario(*problem.dive, problem.settings.own), dive_navigation(study, problem.settings, stop))
            .scenario;
    return problem;
  }
  SimulatedDocking docking = trial_docking(problem.settings);
  problem.gaps = std::move(docking.gaps);
  problem.scenario = make_scenario(std::move(docking));
  return problem;
}

TrialResult run_trial(const Study& study, std::size_t trial, const std::atomic<bool>* stop) {
  const ThreadLimit one_core(1);  // trials run in parallel instead; thread_seconds() then covers the whole trial
  const double begun = thread_seconds();
  TrialResult result;
  result.trial = trial;
  try {
    const TrialSettings settings = study.settings(study.place(trial));
    if (settings.rendezvous) {
      run_rendezvous_trial(settings, stop, result);
      result.set("processor_s", thread_seconds() - begun);
      return result;
    }
    if (!study.has_target()) {
      run_dive_trial(study, settings, stop, result);
      result.set("processor_s", thread_seconds() - begun);
      return result;
    }
    TrialProblem problem = trial_problem(study, trial, stop);
    common(problem.solver).stop = stop;
    if (problem.settings.calibrated) calibrate_noise(problem, stop);
    const std::vector<KeyframeError> errors =
        problem.settings.window > 0 ? newest_errors(problem.scenario, problem.options, problem.settings, stop, result)
                                    : batch_errors(problem, study.covariances, result);
    add_errors(errors, result);
    add_gap_errors(errors, problem.gaps, kAfterGap, result);
    result.set("correlation_time_s", correlation_time(errors));
  } catch (const std::bad_alloc&) {  // A lack of memory depends on the machine, not on the trial.
    throw;
  } catch (const std::exception& error) {  // becomes a row of the study
    if (result.status.empty() || result.status == "converged") result.status = "refused";
    result.message = error.what();
  }
  result.set("processor_s", thread_seconds() - begun);
  return result;
}

}  // namespace tandem
