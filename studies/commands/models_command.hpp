#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/commands/tracking_arguments.hpp>

namespace tandem {

/// The words of `tandem models` as they were typed; nothing where an option was not given.
struct ModelsArguments {
  TrackingArguments tracking;
  std::vector<std::string> models;
  std::optional<std::string> solver, time_limit, out;
  bool json = false, quiet = false;
};

/// Checks everything, estimates with one model after the other, prints and writes; an interrupt ends it with what is
/// there. Returns 0 when every model that was not refused converged, else 2. Throws Error on wrong input, then nothing is
/// written.
int run_models(const ModelsArguments& arguments);

}  // namespace tandem
