#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/cross_validation.hpp>
#include <tandem/solvers/calibration/solve_plainly.hpp>
#include <tandem/studies/calibration/calibrate_scenarios.hpp>
#include <tandem/studies/calibration/calibrated_constants.hpp>
#include <tandem/studies/calibration/followed_tails.hpp>
#include <tandem/studies/calibration/scenario_problems.hpp>
#include <tandem/studies/calibration/undetermined.hpp>

namespace tandem {
namespace {

/// Throws Error where `other` has not the sensors of `first`.
void check_alike(const Scenario& first, const Scenario& other) {
  const auto a = calibrated_entries(first), b = calibrated_entries(other);
  const auto without = [](const std::vector<CalibratedEntry>& all, const CalibratedEntry& one) {
    return std::none_of(all.begin(), all.end(),
                        [&](const CalibratedEntry& e) { return e.name == one.name && e.kind == one.kind; });
  };
  const auto called = [&](const Scenario& s) { return first.name != other.name ? s.name : s.folder.string(); };
  const auto check = [&](const auto& with, const Scenario& in, const auto& lacking, const Scenario& out) {
    for (const CalibratedEntry& e : with) {
      if (!without(lacking, e)) continue;
      const bool error = !e.sensor && e.name.ends_with(".error");
      throw Error(
          fmt::format("{} has no {}{}, which {} has: calibrate scenarios with the same sensors together, or {}",
                      called(out), e.sensor ? e.kind + " sensor " : "noise ", e.name, called(in),
                      error ? fmt::format("give all this error by --error {}", e.name.substr(0, e.name.rfind('.')))
                            : "each by itself"));
    }
  };
  check(a, first, b, other);
  check(b, other, a, first);
  if (first.data.planar != other.data.planar)
    throw Error(fmt::format("{} and {}: one is planar, the other is not", first.name, other.name));
}

/// Throws Error where a number that is meant is of no residual of `other`, whose errors or losses are of another kind.
void check_numbers(const ScenarioCalibrationOptions& options, const Scenario& other) try {
  std::vector<std::string> free = options.free;
  take_numbers(other, options.target, options.own, free);
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

/// Those that are known when it is to stop.
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

/// Of a parameter as found.
Distrust distrust(const ScenarioProblems& problems, std::size_t i, const ScenarioCalibration& result, bool untried) {
  const CalibratedParameter& p = result.parameters[i];
  if (p.result.at_bound) return Distrust::at_bound;
  const NoiseParameters& noise = problems.noise();
  if (i >= noise.groups.size() || p.result.factor >= 1) return Distrust::none;
  if (has_diagnosis(result.after, p.name)) return Distrust::misfit;
  return untried && problems.all().front()->entries[noise.entry[i]].carries ? Distrust::untried : Distrust::none;
}

void validate(ScenarioProblems& problems, const HeldOutStretches& held_out, const CalibrationOptions& options,
              ScenarioCalibration& result) {
  const CrossValidation cv = problems.cross_validate(held_out.folds, options);
  result.folds = static_cast<int>(held_out.folds.size());
  result.why_not_validated = told_of_states(cv.why);
  if (!cv.complete) return;
  result.gain = cv.gain;
  result.gain_error = cv.gain_error;
  for (const auto& problem : problems.all()) result.scores.push_back({problem->scenario});
  for (const bool found : {false, true})
    for (const LeftOutPrediction& p : found ? cv.found : cv.given) {
      const LeftOut& m = held_out.folds[p.fold][p.index];
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
  if (scenarios.empty()) throw Error("calibrate: there is no scenario");
  if (options.folds == 1) throw Error("--folds 1 would hold everything out at once: 2 or more, or 0 for none");
  ScenarioCalibration result;
  for (Scenario& scenario : scenarios) {
    check_alike(scenarios.front(), scenario);
    if (&scenario != &scenarios.front()) {
      copy_noise(scenarios.front(), scenario);
      check_numbers(options, scenario);
    }
    result.scenarios.push_back(scenario.name);
  }
  for (const Scenario& scenario : scenarios)
    if (scenario.navigation && result.held.empty() &&
        (scenario.data.sensors.empty() || scenario.data.odometry.empty())) {
      if (scenario.navigation->imu)
        result.held.push_back(scenario.navigation->imu->name +
                              ": its densities stay as given, since they are summed up between keyframes");
      if (options.noise && options.folds > 0)
        result.held.push_back(
            "What drifts for minutes, as by the scale or the misalignment of a dvl, is not tried: held-out stretches "
            "are "
            "short");
    }
  ScenarioProblems problems(std::move(scenarios), options);
  if (const int rows = problems.measured_rows(); rows < static_cast<int>(problems.num_parameters()))
    throw Error(fmt::format("{} measured values cannot tell {} parameters: name fewer with --free", rows,
                            problems.num_parameters()));

  CalibrationOptions calibration;
  calibration.stop = options.stop;
  calibration.profile = options.profile;
  calibration.measured = problems.measured();
  const auto follow = [&](const std::string& what) {
    if (!options.progress) return;
    calibration.progress = [what, &options](int iteration, const Eigen::VectorXd&, double gain) {
      options.progress(fmt::format("{}iteration {}, evidence {:+.1f}", what, iteration, gain));
    };
  };
  follow("");
  for (std::size_t p = 0; p < result.scenarios.size() && !options.stop.reached(); ++p) {
    const Summary summary = detail::solve_plainly(*problems.plain()[p], options.stop);
    if (!summary.converged() && !options.stop.reached())
      throw Error(
          fmt::format("{}: it cannot be solved with the noise as given: {}", result.scenarios[p], summary.message));
  }
  refuse_followed_tails(problems.all(), problems.numbers(), options.stop);
  result.before = misfits_of_all(problems.all(), options.stop);
  const HeldOutStretches held_out = held_out_stretches(problems.all(), options.folds);
  const bool untried = options.noise && reckons_untried(problems.all(), held_out, result.held);
  result.given_noise = result.noise = problems.given_entries();  // with what is kept later
  std::vector<CalibratedParameter> distrusted;
  while (options.noise) {
    result.summary = problems.calibrate(calibration, result.parameters);
    result.after = misfits_of_all(problems.all(), options.stop);
    if (options.stop.reached()) break;
    const std::size_t before = distrusted.size();
    for (std::size_t i = result.parameters.size(); i-- > 0;)
      if (const Distrust why = distrust(problems, i, result, untried); why != Distrust::none) {
        CalibratedParameter& p = distrusted.emplace_back(result.parameters[i]);
        p.distrust = why;
        p.result.factor = 1;
        problems.keep_given(i);
      }
    if (distrusted.size() == before) break;
    follow(fmt::format("{} kept as given: ", distrusted.size()));
    problems.put_back();
    if (problems.num_parameters() > 0) continue;
    result.summary = {.status = Status::converged,
                      .message = "no parameter is left that noise explains",
                      .iterations = result.summary.iterations,
                      .solves = result.summary.solves};
    result.parameters.clear();
    result.after = result.before;
    break;
  }
  if (!options.noise) {
    result.summary.status = Status::converged;
    result.summary.message = "no noise was asked for";
    result.after = result.before;
  }
  problems.put(result.parameters, result.noise);
  result.parameters.insert(result.parameters.end(), distrusted.rbegin(), distrusted.rend());
  result.cut_short = options.stop.reached();
  const auto constants = [&] {
    if (options.progress && options.folds > 0 && !problems.all().front()->sensor_constants().empty())
      options.progress("constants on held-out measurements");
    find_constants(problems.all(), held_out, calibration, result);
    result.cut_short = options.stop.reached();
  };
  const std::vector<std::string> held = result.held;
  if (!result.cut_short) constants();
  if (options.folds > 0 && problems.num_parameters() > 0 && !options.stop.reached()) {
    problems.put_back();
    follow("held out: ");
    validate(problems, held_out, calibration, result);
    result.cut_short = options.stop.reached();
    if (result.cut_short) {  // not tried to the end: what was found stands, untried
      result.folds = 0;
      result.why_not_validated.clear();
      result.scores.clear();
    } else if (result.folds > 0 && !result.recommended()) {
      result.noise = result.given_noise;
      problems.put_back();
      result.held = held;
      constants();
    }
  }
  if (!options.noise && result.cut_short) {
    result.summary.status = Status::interrupted;
    result.summary.message = result.constants.empty() ? "stopped before the constants were known"
                                                      : "stopped before the constants were tried";
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace

ScenarioCalibration calibrate_scenarios(std::vector<Scenario> scenarios, const ScenarioCalibrationOptions& options) {
  std::string names;
  for (const Scenario& scenario : scenarios) names += (names.empty() ? "" : ", ") + scenario.name;
  try {
    return calibrated(std::move(scenarios), options);
  } catch (const Stopped&) {
    throw;
  } catch (const Error& error) {
    throw Error(told_to_users(error.what(), names));
  }
}

}  // namespace tandem
