#pragma once

#include <optional>
#include <string>
#include <vector>

namespace tandem {

/// The words of `tandem demo` as they were typed; nothing where an option was not given.
struct DemoArguments {
  std::string name;
  std::optional<std::string> solver, out, plots;
};

/// What `name` may be.
std::vector<std::string> demo_names();

/// Checks everything, solves, prints a table and draws. Returns 0 when the solver converged, else 2. Throws Error on
/// wrong input, then nothing is written.
int run_demo(const DemoArguments& arguments);

}  // namespace tandem
