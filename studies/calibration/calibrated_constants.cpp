#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/calibration/calibrated_constants.hpp>
#include <tandem/studies/calibration/constant_trials.hpp>
#include <tandem/studies/calibration/singularity_messages.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Adds the predictive gain of each trial to the constants of a problem, which start at index `first`.
void add_trials(const CalibrationProblem& problem, std::size_t first, const std::vector<ConstantTrial>& trials,
                bool short_segments, ScenarioCalibration& result) {
  std::vector<std::string> untested;
  for (const ConstantTrial& trial : trials) {
    // An error of dead reckoning may show only over gaps that are longer than the held-out segments.
    if (short_segments && trial.gain <= trial.gain_error && problem.is_own(trial.name)) {
      untested.push_back(trial.name);
      continue;
    }
    for (std::size_t i = first; i < result.constants.size(); ++i) {
      SystematicErrorEstimate& c = result.constants[i].found;
      if (c.name == trial.name || c.name.starts_with(trial.name + ".")) c.held_out = {trial.gain, trial.gain_error};
    }
  }
  if (!untested.empty())
    result.notes.push_back(
        fmt::format("{}: held-out segments are too short to cross-validate {}, whose effect on the position shows only "
                    "over the gaps without fixes",
                    problem.scenario, listed(untested)));
}

}  // namespace

void estimate_constants(const CalibrationProblems& problems, const HeldOutFolds& held_out,
                        const CalibrationOptions& options, ScenarioCalibration& result) {
  result.constants.clear();
  for (std::size_t p = 0; p < problems.size(); ++p) {
    CalibrationProblem& problem = *problems[p];
    const std::size_t first = result.constants.size();
    const auto note_failure = [&](const char* what, const std::string& why) {
      result.notes.push_back(fmt::format("{}: {}: {}", problem.scenario, what, why));
    };
    for (const std::string& sensor : problem.without_measurements)
      result.notes.push_back(fmt::format("{}: {} has no measurements, so its systematic errors cannot be estimated",
                                         problem.scenario, sensor));
    try {
      for (SystematicErrorEstimate& c : problem.constants(options.stop))
        result.constants.push_back({problem.scenario, std::move(c)});
    } catch (const Stopped&) {
      result.constants.clear();
      return;
    } catch (const NumericalError& error) {
      note_failure("the constants have no standard errors", explain_singularity(error));
      continue;
    }
    if (problem.sensor_constants().empty()) continue;
    std::vector<std::vector<HeldOutMeasurement>> folds = held_out.folds;
    for (auto& fold : folds)
      std::erase_if(fold, [&](const HeldOutMeasurement& m) { return std::size_t(m.problem) != p; });
    try {
      for (std::size_t i = first; i < result.constants.size() && options.profile_points > 0; ++i)
        result.constants[i].profile = problem.evidence_along(result.constants[i].found, options.stop);
      if (folds.empty()) continue;
      const ConstantTrials tried =
          cross_validate_constants(problem.problem(), problem.sensor_constants(), folds, options);
      if (!tried.why.empty()) note_failure("cross-validation of the constants failed", tried.why);
      add_trials(problem, first, tried.trials, problem.longest_without_fix > held_out.segment_length[p], result);
    } catch (const Stopped&) {  // estimated, but not cross-validated
      return;
    }
  }
}

}  // namespace tandem
