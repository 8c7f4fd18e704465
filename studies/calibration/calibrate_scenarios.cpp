#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/cross_validation.hpp>
#include <tandem/solvers/calibration/saved_noise.hpp>
#include <tandem/solvers/calibration/solve_plainly.hpp>
#include <tandem/studies/calibration/calibrate_scenarios.hpp>
#include <tandem/studies/calibration/calibrated_constants.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr double kStretch = 10.0;  // s that are held out at once: predictions across a gap count as those at hand do

/// Throws Error where `other` has not the sensors of `first`.
void check_alike(const Scenario& first, const Scenario& other) {
  const auto a = calibrated_entries(first), b = calibrated_entries(other);
  const auto without = [](const std::vector<CalibratedEntry>& all, const CalibratedEntry& one) {
    return std::none_of(all.begin(), all.end(),
                        [&](const CalibratedEntry& e) { return e.name == one.name && e.kind == one.kind; });
  };
  const auto check = [&](const auto& with, const Scenario& in, const auto& lacking, const Scenario& out) {
    for (const CalibratedEntry& e : with)
      if (without(lacking, e))
        throw Error(
            fmt::format("{} has no {}{}, which {} has: calibrate scenarios with the same sensors together, or "
                        "leave it out with --without {}",
                        out.name, e.sensor ? e.kind + " sensor " : "noise ", e.name, in.name, e.name));
  };
  check(a, first, b, other);
  check(b, other, a, first);
  if (first.data.planar != other.data.planar)
    throw Error(fmt::format("{} and {}: one is planar, the other is not", first.name, other.name));
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

/// The parameters that are meant, with their groups; those of `held` have no data.
class Parameters {
 public:
  Parameters(const Problems& problems, const ScenarioCalibrationOptions& options) {
    const std::vector<CalibratedEntry>& entries = problems.front()->entries;
    check_names(entries, options.free);
    for (std::size_t e = 0; e < entries.size(); ++e)
      for (std::size_t c = 0; c < entries[e].components.size(); ++c) {
        const std::string name = entries[e].parameter(c);
        const bool named = is_among(name, options.free) || is_among(entries[e].name, options.free);
        if (!options.noise || (!named && !options.free.empty())) continue;
        NoiseGroup group{name, {}, options.prior};
        add_rows(problems, e, c, group);
        if (group.rows.empty()) {
          if (named)
            throw Error(fmt::format("--free {}: no residual of {} has this noise", name, problems.front()->scenario));
          continue;
        }
        groups.push_back(std::move(group));
        entry.push_back(e);
        component.push_back(c);
      }
    if (groups.empty() && options.noise) throw Error("calibrate: there is no noise with residuals of its own");
  }

  /// Takes one out.
  void keep_given(std::size_t g) {
    const auto at = std::ptrdiff_t(g);
    groups.erase(groups.begin() + at);
    entry.erase(entry.begin() + at);
    component.erase(component.begin() + at);
  }

  std::vector<NoiseGroup> groups;
  std::vector<std::size_t> entry, component;  ///< of each group

 private:
  static bool is_among(const std::string& name, const std::vector<std::string>& names) {
    return std::find(names.begin(), names.end(), name) != names.end();
  }
  static void check_names(const std::vector<CalibratedEntry>& entries, const std::vector<std::string>& free) {
    std::vector<std::string> known, near, shown;  // near: constants, too, which are taken out before
    for (const CalibratedEntry& e : entries) {
      known.push_back(e.name);
      std::vector<std::string> components;
      for (std::size_t c = 0; c < e.components.size(); ++c)
        if (!e.components[c].empty()) known.push_back(e.parameter(c)), components.push_back(e.components[c]);
      shown.push_back(components.empty() ? e.name : fmt::format("{} ({})", e.name, fmt::join(components, ", ")));
    }
    near = known;
    for (const CalibratedEntry& e : entries)
      if (e.sensor)
        for (const char* constant : {".scale", ".misalignment", ".delay"}) near.push_back(e.name + constant);
    for (const std::string& name : free)
      if (!is_among(name, known))
        throw Error(fmt::format(
            "--free knows no {}{} (here, in brackets components as in usbl.x: {}; of sensors scale, misalignment and "
            "delay, too)",
            quote(name), did_you_mean(name, near), listed(shown)));
  }
  static void add_rows(const Problems& problems, std::size_t e, std::size_t c, NoiseGroup& group) {
    for (std::size_t p = 0; p < problems.size(); ++p) {
      CalibrationProblem& built = *problems[p];
      const auto& entries = built.entries;
      const CalibratedEntry& wanted = problems.front()->entries[e];
      for (const EntryBlock& b : built.blocks) {
        const CalibratedEntry& entry = entries[b.entry];
        if (entry.name != wanted.name) continue;
        const int rows = static_cast<int>(built.problem().noise(b.block).dim());
        const int n = static_cast<int>(entry.components.size());
        for (int i = entry.row[c] - b.first; i < rows; i += n)
          if (i >= 0)
            group.rows.push_back({b.block, i, 1, static_cast<int>(p), b.shared < 0 || i < b.shared ? b.share : 1.0});
      }
    }
  }
};

/// Of a problem's measurements, the first time [s] and how long each stretch is that is held out at once.
std::pair<double, double> stretches_of(const CalibrationProblem& built, int n) {
  double from = HUGE_VAL, to = -HUGE_VAL;
  for (const EntryBlock& b : built.blocks)
    if (b.measured_at) {
      from = std::min(from, *b.measured_at);
      to = std::max(to, *b.measured_at);
    }
  return {from, std::min(kStretch, std::max((to - from) / (2 * n), 1e-3))};
}

/// Whether held-out stretches are too short to show what less noise of dead reckoning would do; says so in `held`.
bool reckons_untried(const Problems& problems, int folds, std::vector<std::string>& held) {
  bool any = false;
  for (const auto& problem : problems) {
    if (folds == 0 || problem->longest_without_fix <= stretches_of(*problem, folds).second) continue;
    any = true;
    held.push_back(
        fmt::format("{}: {:.0f} s without a fix of the position, when {:.0f} s are held out at once, which do not show "
                    "errors that stay: less noise than given is not believed of what the position rests on meanwhile",
                    problem->scenario, problem->longest_without_fix, stretches_of(*problem, folds).second));
  }
  return any;
}

/// All measurements, in stretches that take turns.
std::vector<std::vector<LeftOut>> folds_of(const Problems& problems, int n) {
  std::vector<std::vector<LeftOut>> folds(static_cast<std::size_t>(n));
  for (std::size_t p = 0; p < problems.size(); ++p) {
    CalibrationProblem& built = *problems[p];
    const auto [from, stretch] = stretches_of(built, n);
    for (const EntryBlock& b : built.blocks)
      if (b.measured_at) {
        const auto fold = std::size_t((*b.measured_at - from) / stretch) % folds.size();
        folds[fold].push_back({b.block, static_cast<int>(p), built.problem().loss(b.block), b.whole});
      }
  }
  return folds;
}

std::vector<NoiseEntry> given_entries(const Problems& problems, const Parameters& parameters) {
  std::vector<NoiseEntry> result;
  for (const std::size_t e : parameters.entry) {
    const CalibratedEntry& entry = problems.front()->entries[e];
    if (result.empty() || result.back().name != entry.name) result.push_back({entry.name, entry.sigmas});
  }
  return result;
}

void scale(const Problems& problems, const Parameters& parameters, const Calibration& found,
           std::vector<NoiseEntry>& noise) {
  for (std::size_t g = 0; g < parameters.groups.size(); ++g) {
    const std::string& name = problems.front()->entries[parameters.entry[g]].name;
    for (NoiseEntry& entry : noise)
      if (entry.name == name) entry.sigmas[parameters.component[g]] *= found.noise[g].factor;
  }
}

/// Those that are known when it is to stop.
std::vector<Misfit> misfits_of_all(const Problems& problems, const Stop& stop) {
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

void validate(const Problems& problems, const std::vector<Problem*>& plain, const Parameters& parameters, int folds,
              const CalibrationOptions& options, ScenarioCalibration& result) {
  const auto left_out = folds_of(problems, folds);
  const CrossValidation cv = cross_validate(plain, parameters.groups, left_out, options);
  result.folds = folds;
  result.why_not_validated = cv.why;
  if (!cv.complete) return;
  result.gain = cv.gain;
  result.gain_error = cv.gain_error;
  for (const auto& problem : problems) result.scores.push_back({problem->scenario});
  for (const bool found : {false, true})
    for (const LeftOutPrediction& p : found ? cv.found : cv.given) {
      const LeftOut& m = left_out[p.fold][p.index];
      HeldOutScore& score = result.scores[std::size_t(m.problem)];
      (found ? score.found : score.given) += p.log_density(m.loss);
      if (found) ++score.measurements;
    }
  for (HeldOutScore& score : result.scores) {
    score.given /= std::max(score.measurements, 1);
    score.found /= std::max(score.measurements, 1);
  }
}

}  // namespace

ScenarioCalibration calibrate_scenarios(std::vector<Scenario> scenarios, const ScenarioCalibrationOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  if (scenarios.empty()) throw Error("calibrate: there is no scenario");
  if (options.folds == 1) throw Error("--folds 1 would hold everything out at once: 2 or more, or 0 for none");
  ScenarioCalibration result;
  for (Scenario& scenario : scenarios) {
    check_alike(scenarios.front(), scenario);
    if (&scenario != &scenarios.front()) copy_noise(scenarios.front(), scenario);
    result.scenarios.push_back(scenario.name);
  }
  Problems problems;
  std::vector<Problem*> plain;
  for (Scenario& scenario : scenarios) {
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
    NavigationOptions own = options.own;
    options.stop.limit(own.solver);
    problems.push_back(
        std::make_unique<CalibrationProblem>(std::move(scenario), options.target, own, options.stop.with_grace()));
    plain.push_back(&problems.back()->problem());
  }
  Parameters parameters(problems, options);
  int rows = 0;
  for (const auto& problem : problems)
    for (const EntryBlock& b : problem->blocks)
      if (b.measured_at) rows += static_cast<int>(problem->problem().noise(b.block).dim());
  if (rows < static_cast<int>(parameters.groups.size()))
    throw Error(fmt::format("{} measured values cannot tell {} parameters: name fewer with --free", rows,
                            parameters.groups.size()));

  CalibrationOptions calibration;
  calibration.stop = options.stop;
  calibration.profile = options.profile;
  for (std::size_t p = 0; p < problems.size(); ++p)
    for (const EntryBlock& b : problems[p]->blocks)
      if (b.measured_at) calibration.measured.push_back({b.block, static_cast<int>(p)});
  const auto follow = [&](const std::string& what) {
    if (!options.progress) return;
    calibration.progress = [what, &options](int iteration, const Eigen::VectorXd&, double gain) {
      options.progress(fmt::format("{}iteration {}, evidence {:+.1f}", what, iteration, gain));
    };
  };
  follow("");
  const detail::SavedNoise given(plain, parameters.groups);
  for (std::size_t p = 0; p < plain.size() && !options.stop.reached(); ++p) {
    const Summary summary = detail::solve_plainly(*plain[p], options.stop);
    if (!summary.converged() && !options.stop.reached())
      throw Error(
          fmt::format("{}: it cannot be solved with the noise as given: {}", result.scenarios[p], summary.message));
  }
  result.before = misfits_of_all(problems, options.stop);
  const bool untried = options.noise && reckons_untried(problems, options.folds, result.held);
  result.given_noise = given_entries(problems, parameters);  // with what is kept later
  std::vector<CalibratedParameter> distrusted;
  while (options.noise) {
    result.summary = calibrate(plain, parameters.groups, calibration);
    result.after = misfits_of_all(problems, options.stop);
    result.parameters.clear();
    for (std::size_t g = 0; g < parameters.groups.size(); ++g)
      result.parameters.push_back({parameters.groups[g].name,
                                   problems.front()->entries[parameters.entry[g]].sigmas[parameters.component[g]],
                                   result.summary.noise[g]});
    if (options.stop.reached()) break;
    const std::size_t before = distrusted.size();
    for (std::size_t g = parameters.groups.size(); g-- > 0;)
      if (CalibratedParameter& p = result.parameters[g]; p.result.at_bound || p.result.factor < 1) {
        if (p.result.at_bound)
          p.distrust = Distrust::at_bound;
        else if (has_diagnosis(result.after, p.name))
          p.distrust = Distrust::misfit;
        else if (untried && problems.front()->entries[parameters.entry[g]].carries)
          p.distrust = Distrust::untried;
        else
          continue;
        p.result.factor = 1;
        distrusted.push_back(p);
        parameters.keep_given(g);
      }
    if (distrusted.size() == before) break;
    follow(fmt::format("{} kept as given: ", distrusted.size()));
    given.restore();
    for (Problem* problem : plain) detail::solve_plainly(*problem, options.stop);
    if (!parameters.groups.empty()) continue;
    result.summary = {};
    result.summary.status = Status::converged;
    result.summary.message = "no parameter is left that noise explains";
    result.parameters.clear();
    result.after = result.before;
    break;
  }
  if (!options.noise) {
    result.summary.status = Status::converged;
    result.summary.message = "no noise was asked for";
    result.after = result.before;
  }
  result.parameters.insert(result.parameters.end(), distrusted.rbegin(), distrusted.rend());
  result.noise = result.given_noise;
  scale(problems, parameters, result.summary, result.noise);
  result.cut_short = options.stop.reached();
  HeldOutStretches held_out;
  if (options.folds > 0) held_out.folds = folds_of(problems, options.folds);
  for (std::size_t p = 0; p < problems.size() && options.folds > 0; ++p)
    held_out.seconds.push_back(stretches_of(*problems[p], options.folds).second);
  const auto constants = [&] {
    if (options.progress && options.folds > 0 && !problems.front()->sensor_constants().empty())
      options.progress("constants on held-out measurements");
    find_constants(problems, held_out, calibration, result);
    result.cut_short = options.stop.reached();
  };
  const std::vector<std::string> held = result.held;
  if (!result.cut_short) constants();
  if (options.folds > 0 && !parameters.groups.empty() && !options.stop.reached()) {
    given.restore();
    for (Problem* problem : plain) detail::solve_plainly(*problem, options.stop);
    follow("held out: ");
    validate(problems, plain, parameters, options.folds, calibration, result);
    result.cut_short = options.stop.reached();
    if (result.cut_short) {  // not tried to the end: what was found stands, untried
      result.folds = 0;
      result.why_not_validated.clear();
      result.scores.clear();
    } else if (result.folds > 0 && !result.recommended()) {
      result.noise = result.given_noise;
      given.restore();
      for (Problem* problem : plain) detail::solve_plainly(*problem, options.stop);
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

}  // namespace tandem
