#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/cross_validation.hpp>
#include <tandem/solvers/calibration/default_solve.hpp>
#include <tandem/studies/calibration/calibrate_scenarios.hpp>
#include <tandem/studies/calibration/calibrated_constants.hpp>
#include <tandem/studies/calibration/degrees_of_freedom_check.hpp>
#include <tandem/studies/calibration/scenario_problems.hpp>
#include <tandem/studies/calibration/singularity_messages.hpp>

namespace tandem {
namespace {

/// Throws Error if the scenarios have different sensors or noise entries.
void check_same_sensors(const Scenario& first, const Scenario& other) {
  const auto a = calibrated_entries(first), b = calibrated_entries(other);
  const auto without = [](const std::vector<CalibratedEntry>& all, const CalibratedEntry& one) {
    return std::none_of(all.begin(), all.end(),
                        [&](const CalibratedEntry& e) { return e.name == one.name && e.kind == one.kind; });
  };
  const auto label = [&](const Scenario& s) { return first.name != other.name ? s.name : s.folder.string(); };
  const auto check = [&](const auto& with, const Scenario& in, const auto& lacking, const Scenario& out) {
    for (const CalibratedEntry& e : with) {
      if (!without(lacking, e)) continue;
      const bool error = !e.sensor && e.name.ends_with(".error");
      throw Error(
          fmt::format("{} has no {}{}, but {} has; scenarios that are calibrated together need the same sensors: {}",
                      label(out), e.sensor ? e.kind + " sensor " : "noise ", e.name, label(in),
                      error ? fmt::format("set this error for all by --error {}", e.name.substr(0, e.name.rfind('.')))
                            : "calibrate each separately"));
    }
  };
  check(a, first, b, other);
  check(b, other, a, first);
  if (first.data.planar != other.data.planar)
    throw Error(fmt::format("{} and {} cannot be calibrated together: one is planar, the other is not", first.name,
                            other.name));
}

/// Throws Error if `other` lacks a model parameter named in `free`, e.g. because its losses differ.
void check_model_parameters(const ScenarioCalibrationOptions& options, const Scenario& other) try {
  std::vector<std::string> free = options.free;
  take_model_parameters(other, options.target, options.own, free);
} catch (const Error& error) {
  throw Error(fmt::format("{}: {}", other.name, error.what()));
}

void copy_noise(const Scenario& from, Scenario& to) {
  to.data.noise = from.data.noise;
  for (TargetSensor& sensor : to.data.sensors)
    for (const TargetSensor& s : from.data.sensors)
      if (s.name == sensor.name) sensor.sigma = s.sigma;
  if (to.navigation && from.navigation)
    for (EgoSensor& sensor : to.navigation->sensors)
      for (const EgoSensor& s : from.navigation->sensors)
        if (s.name == sensor.name) sensor.sigma = s.sigma;
}

/// Returns the misfits of all problems, or those computed before a stop.
std::vector<Misfit> misfits_of_all(const CalibrationProblems& problems, const Stop& stop) {
  std::vector<Misfit> all;
  try {
    for (const auto& problem : problems) {
      stop.check("misfits");
      for (Misfit& m : misfits(*problem, stop)) all.push_back(std::move(m));
    }
  } catch (const Stopped&) {
  }
  return all;
}

bool has_diagnosis(const std::vector<Misfit>& misfits, const std::string& parameter) {
  return std::any_of(misfits.begin(), misfits.end(),
                     [&](const Misfit& m) { return m.parameter == parameter && !m.diagnosis().empty(); });
}

bool has_correlation(const std::vector<Misfit>& misfits) {
  return std::any_of(misfits.begin(), misfits.end(), [](const Misfit& m) { return m.correlation_time() > 0; });
}

/// Returns whether, and why, the estimate of parameter i is not accepted.
KeepReason keep_reason(const ScenarioProblems& problems, std::size_t i, const ScenarioCalibration& result,
                       bool untested_dead_reckoning) {
  const CalibratedParameter& p = result.parameters[i];
  if (p.result.at_limit) return KeepReason::at_limit;
  const NoiseParameters& noise = problems.noise();
  if (i >= noise.groups.size() || p.result.factor >= 1) return KeepReason::none;
  const CalibratedEntry& entry = problems.all().front()->entries[noise.entry[i]];
  // The noise of a motion model explains the residuals of all sensors.
  if (has_diagnosis(result.after, p.name) || (!entry.sensor && has_correlation(result.after)))
    return KeepReason::misfit;
  return untested_dead_reckoning && entry.dead_reckoning ? KeepReason::untested : KeepReason::none;
}

/// Cross-validates the calibration and stores the scores.
void validate(ScenarioProblems& problems, const HeldOutFolds& held_out, const CalibrationOptions& options,
              ScenarioCalibration& result) {
  const CrossValidation cv = problems.cross_validate(held_out.folds, options);
  result.folds = static_cast<int>(held_out.folds.size());
  result.why_not_validated = cv.unobservable.empty() ? cv.why : undetermined(cv.unobservable);
  if (!cv.complete) return;
  result.gain = cv.gain;
  result.gain_error = cv.gain_error;
  for (const auto& problem : problems.all()) result.scores.push_back({problem->scenario});
  for (const bool found : {false, true})
    for (const HeldOutPrediction& p : found ? cv.found : cv.given) {
      const HeldOutMeasurement& m = held_out.folds[p.fold][p.index];
      HeldOutScore& score = result.scores[std::size_t(m.problem)];
      (found ? score.found : score.given) += p.log_likelihood;
      if (found) ++score.measurements;
    }
  for (HeldOutScore& score : result.scores) {
    score.given /= std::max(score.measurements, 1);
    score.found /= std::max(score.measurements, 1);
  }
}

ScenarioCalibration calibrated(std::vector<Scenario> scenarios, const ScenarioCalibrationOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  if (scenarios.empty()) throw Error("calibrate: no scenario is given");
  if (options.folds == 1)
    throw Error("--folds 1 would hold out all measurements at once; use 2 or more, or 0 for no cross-validation");
  ScenarioCalibration result;
  for (Scenario& scenario : scenarios) {
    check_same_sensors(scenarios.front(), scenario);
    if (&scenario != &scenarios.front()) {
      copy_noise(scenarios.front(), scenario);
      check_model_parameters(options, scenario);
    }
    result.scenarios.push_back(scenario.name);
  }
  for (const Scenario& scenario : scenarios)
    if (scenario.navigation && result.notes.empty() &&
        (scenario.data.sensors.empty() || scenario.data.odometry.empty())) {
      if (scenario.navigation->imu)
        result.notes.push_back(scenario.navigation->imu->name +
                               ": the noise densities are not calibrated, since samples are preintegrated");
      if (options.noise && options.folds > 0)
        result.notes.push_back(
            "Cross-validation does not test slow drifts of minutes, e.g. from a scale factor error or misalignment of "
            "a DVL: held-out segments are too short");
    }
  ScenarioProblems problems(std::move(scenarios), options);
  if (const int rows = problems.measured_rows(); rows < static_cast<int>(problems.num_parameters()))
    throw Error(fmt::format("{} measured values are too few for {} parameters; name fewer with --free", rows,
                            problems.num_parameters()));

  CalibrationOptions calibration;
  calibration.stop = options.stop;
  calibration.profile_points = options.profile_points;
  calibration.measured = problems.measured();
  const auto set_progress_prefix = [&](const std::string& what) {
    if (!options.progress) return;
    calibration.progress = [what, &options](int iteration, const Eigen::VectorXd&, double gain) {
      options.progress(fmt::format("{}iteration {}, evidence {:+.1f}", what, iteration, gain));
    };
  };
  set_progress_prefix("");
  for (std::size_t p = 0; p < result.scenarios.size() && !options.stop.reached(); ++p) {
    const Summary summary = detail::solve_with_default(*problems.raw_problems()[p], options.stop);
    if (!summary.converged() && !options.stop.reached())
      throw Error(fmt::format("{} cannot be solved with the given noise: {}", result.scenarios[p], summary.message));
  }
  check_degrees_of_freedom(problems.all(), problems.model_parameters(), options.stop);
  result.before = misfits_of_all(problems.all(), options.stop);
  const HeldOutFolds held_out = make_held_out_folds(problems.all(), options.folds);
  const bool untested = options.noise && has_untested_dead_reckoning(problems.all(), held_out, result.notes);
  result.given_noise = result.noise = problems.given_entries();  // also of rejected estimates
  std::vector<CalibratedParameter> kept;
  while (options.noise) {
    result.summary = problems.calibrate(calibration, result.parameters);
    result.after = misfits_of_all(problems.all(), options.stop);
    if (options.stop.reached()) break;
    const std::size_t before = kept.size();
    for (std::size_t i = result.parameters.size(); i-- > 0;)
      if (const KeepReason why = keep_reason(problems, i, result, untested); why != KeepReason::none) {
        CalibratedParameter& p = kept.emplace_back(result.parameters[i]);
        p.keep_reason = why;
        p.result.factor = 1;
        problems.keep_given(i);
      }
    if (kept.size() == before) break;
    set_progress_prefix(fmt::format("{} parameters kept as given: ", kept.size()));
    problems.restore_given();
    if (problems.num_parameters() > 0) continue;
    result.summary = {.status = Status::converged,
                      .message = "no estimate is accepted",
                      .iterations = result.summary.iterations,
                      .solves = result.summary.solves};
    result.parameters.clear();
    result.after = result.before;
    break;
  }
  if (!options.noise) {
    result.summary.status = Status::converged;
    result.summary.message = "no noise to calibrate";
    result.after = result.before;
  }
  problems.apply_factors(result.parameters, result.noise);
  result.parameters.insert(result.parameters.end(), kept.rbegin(), kept.rend());
  result.cut_short = options.stop.reached();
  const auto constants = [&] {
    if (options.progress && options.folds > 0 && !problems.all().front()->sensor_constants().empty())
      options.progress("cross-validation of constants");
    estimate_constants(problems.all(), held_out, calibration, result);
    result.cut_short = options.stop.reached();
  };
  const std::vector<std::string> notes = result.notes;
  if (!result.cut_short) constants();
  if (options.folds > 0 && problems.num_parameters() > 0 && !options.stop.reached()) {
    problems.restore_given();
    set_progress_prefix("cross-validation: ");
    validate(problems, held_out, calibration, result);
    result.cut_short = options.stop.reached();
    if (result.cut_short) {  // incomplete: the estimates stay, without validation
      result.folds = 0;
      result.why_not_validated.clear();
      result.scores.clear();
    } else if (result.folds > 0 && !result.recommended()) {
      result.noise = result.given_noise;
      problems.restore_given();
      result.notes = notes;
      constants();
    }
  }
  if (!options.noise && result.cut_short) {
    result.summary.status = Status::interrupted;
    result.summary.message = result.constants.empty() ? "stopped before the constants were estimated"
                                                      : "stopped before the constants were cross-validated";
  }
  if (result.cut_short && !result.recommended()) result.noise = result.given_noise;
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace

ScenarioCalibration calibrate_scenarios(std::vector<Scenario> scenarios, const ScenarioCalibrationOptions& options) {
  std::string names;
  for (const Scenario& scenario : scenarios) names += (names.empty() ? "" : ", ") + scenario.name;
  try {
    return calibrated(std::move(scenarios), options);
  } catch (const NotObservableError& error) {
    throw NotObservableError(with_remedies(error, names), error.states());
  }
}

}  // namespace tandem
