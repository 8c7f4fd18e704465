#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/calibration/calibrated_constants.hpp>
#include <tandem/studies/calibration/constant_trials.hpp>
#include <tandem/studies/calibration/undetermined.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Tells each of a problem's constants, the result's from `first` on, by its trial, how it predicts held-out measurements.
void add_trials(const CalibrationProblem& problem, std::size_t first, const std::vector<ConstantTrial>& trials,
                bool short_stretches, ScenarioCalibration& result) {
  std::vector<std::string> untried;
  for (const ConstantTrial& trial : trials) {
    // Over longer than is held out an error of dead reckoning may well show.
    if (short_stretches && trial.gain <= trial.gain_error && problem.is_own(trial.name)) {
      untried.push_back(trial.name);
      continue;
    }
    for (std::size_t i = first; i < result.constants.size(); ++i) {
      FoundConstant& c = result.constants[i].found;
      if (c.name == trial.name || c.name.starts_with(trial.name + ".")) c.held_out = {trial.gain, trial.gain_error};
    }
  }
  if (!untried.empty())
    result.held.push_back(
        fmt::format("{}: what is held out at once is too short to try {}, which show{} in the position over the times "
                    "without a fix of it",
                    problem.scenario, listed(untried), untried.size() == 1 ? "s" : ""));
}

}  // namespace

void find_constants(const CalibrationProblems& problems, const HeldOutStretches& held_out,
                    const CalibrationOptions& options, ScenarioCalibration& result) {
  result.constants.clear();
  for (std::size_t p = 0; p < problems.size(); ++p) {
    CalibrationProblem& problem = *problems[p];
    const std::size_t first = result.constants.size();
    const auto say_not = [&](const char* what, const std::string& why) {
      result.held.push_back(fmt::format("{}: {}: {}", problem.scenario, what, told_of_states(why)));
    };
    for (const std::string& sensor : problem.without_measurements)
      result.held.push_back(
          fmt::format("{}: {} has no measurements that its errors would be told by", problem.scenario, sensor));
    try {
      for (FoundConstant& c : problem.constants(options.stop))
        result.constants.push_back({problem.scenario, std::move(c)});
    } catch (const Stopped&) {
      result.constants.clear();
      return;
    } catch (const Error& error) {
      say_not("no standard errors of constants", error.what());
      continue;
    }
    if (problem.sensor_constants().empty()) continue;
    std::vector<std::vector<LeftOut>> folds = held_out.folds;
    for (auto& fold : folds) std::erase_if(fold, [&](const LeftOut& m) { return std::size_t(m.problem) != p; });
    try {
      for (std::size_t i = first; i < result.constants.size() && options.profile > 0; ++i)
        result.constants[i].profile = problem.evidence_along(result.constants[i].found, options.stop);
      if (folds.empty()) continue;
      const ConstantTrials tried = try_constants(problem.problem(), problem.sensor_constants(), folds, options);
      if (!tried.why.empty()) say_not("constants are not tried on held-out data", tried.why);
      add_trials(problem, first, tried.trials, problem.longest_without_fix > held_out.seconds[p], result);
    } catch (const Stopped&) {  // found, and not tried
      return;
    }
  }
}

}  // namespace tandem
