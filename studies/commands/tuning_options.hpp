#pragma once

#include <span>

#include <tandem/studies/commands/command_options.hpp>
#include <tandem/studies/tuning/tune.hpp>

namespace tandem {

/// Returns the default time limit of tune() [s], longer if a scenario has sensors of the chaser's own motion.
double default_tuning_time(std::span<const Scenario> scenarios);

/// Returns options of tune() that start from the options of the target and the sensors on the command line.
TuneOptions tune_options(const CommandOptions& option);

/// Returns the scenario, as it was read, with the selected model.
TunedProblem tuned_problem(const Tuning& tuning, const Scenario& scenario);

}  // namespace tandem
