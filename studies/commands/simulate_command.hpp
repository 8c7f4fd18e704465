#pragma once

#include <optional>
#include <string>
#include <vector>

namespace tandem {

/// The words of `tandem simulate` as they were typed; nothing where an option was not given.
struct SimulateArguments {
  std::string name;
  std::optional<std::string> out, grade, minutes, seed, latitude, keyframe_interval, surfacings;
};

/// What `name` may be.
std::vector<std::string> simulation_names();

/// Writes a scenario folder. Returns 0. Throws Error on wrong input, then nothing is written.
int run_simulate(const SimulateArguments& arguments);

}  // namespace tandem
