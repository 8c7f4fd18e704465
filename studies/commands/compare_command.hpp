#pragma once

#include <optional>
#include <string>

#include <tandem/studies/commands/tracking_arguments.hpp>

namespace tandem {

/// The words of `tandem compare` as they were typed; nothing where an option was not given.
struct CompareArguments {
  TrackingArguments tracking;
  std::optional<std::string> solvers, constraints, time_limit, dense_keyframes, out, plots;
  bool json = false, quiet = false;
};

/// Checks everything, runs every solver on every problem, prints and writes; an interrupt ends it with what is there.
/// Returns 0, or 2 when interrupted: how the solvers did is the result. Throws Error on wrong input, then nothing is
/// written.
int run_compare(const CompareArguments& arguments);

}  // namespace tandem
