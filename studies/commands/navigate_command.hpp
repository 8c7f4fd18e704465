#pragma once

#include <optional>
#include <string>

#include <tandem/studies/commands/navigate_arguments.hpp>

namespace tandem {

/// The words of `tandem navigate` as they were typed; nothing where an option was not given.
struct NavigateArguments {
  NavigationArguments navigation;
  std::optional<std::string> after, max_iterations, time_limit, out, plots;
  bool json = false, quiet = false;
};

/// Checks everything, navigates, prints, and writes; an interrupt ends the solve at its best point, a second one the
/// program. Returns 0 when the solver converged, else 2. Throws Error on wrong input, then nothing is written.
int run_navigate(const NavigateArguments& arguments);

}  // namespace tandem
