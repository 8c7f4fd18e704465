#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/commands/tracking_arguments.hpp>

namespace tandem {

/// The words of `tandem estimate` as they were typed; nothing where an option was not given.
struct EstimateArguments {
  TrackingArguments tracking;
  std::optional<std::string> solver, hessian, max_iterations, time_limit, out, plots;
  std::vector<std::string> ipopt;
  bool graduated = false, json = false, quiet = false;
};

/// Checks everything, solves, prints, and writes; an interrupt ends the solve at its best point, a second one
/// the program. Returns 0 when the solver converged, else 2. Throws Error on wrong input, then nothing is
/// written.
int run_estimate(const EstimateArguments& arguments);

}  // namespace tandem
