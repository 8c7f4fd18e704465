#pragma once

#include <tandem/studies/commands/command_options.hpp>
#include <tandem/studies/tuning/tune.hpp>

namespace tandem {

inline constexpr double kTuningTime = 120;  ///< default time limit of tune() [s]

/// Returns options of tune() that start from the options of the target and the sensors on the command line.
TuneOptions tune_options(const CommandOptions& option);

/// Returns the scenario, as it was read, with the selected model.
TunedProblem tuned_problem(const Tuning& tuning, const Scenario& scenario);

}  // namespace tandem
