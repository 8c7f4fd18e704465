#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/simulate_command.hpp>
#include <tandem/studies/simulation/simulate_dive_files.hpp>
#include <tandem/studies/simulation/simulate_docking.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_folder.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

double number(const std::string& option, const std::string& text) {
  const auto value = parse_number(text);
  if (!value || !std::isfinite(*value)) throw Error(fmt::format("{} takes a number, not {}", option, quote(text)));
  return *value;
}

/// Options that the named simulation does not know are refused, not passed over.
void refuse(const SimulateArguments& arguments, const std::optional<std::string>& value, const std::string& option) {
  if (value) throw Error(fmt::format("simulate {} takes no {}", arguments.name, option));
}

Grade parse_grade(const std::string& text) {
  for (const Grade grade : {Grade::mems, Grade::tactical})
    if (name(grade) == text) return grade;
  throw Error(fmt::format("--grade is mems or tactical, not {}{}", quote(text),
                          did_you_mean(text, {std::string(name(Grade::mems)), std::string(name(Grade::tactical))})));
}

template <class Options>
void set_common(const SimulateArguments& arguments, Options& options) {
  if (arguments.minutes) options.minutes = number("--minutes", *arguments.minutes);
  if (arguments.seed) options.seed = static_cast<std::uint64_t>(parse_count("--seed", *arguments.seed));
}

}  // namespace

std::vector<std::string> simulation_names() { return {"dive", "docking"}; }

int run_simulate(const SimulateArguments& arguments) {
  const std::vector<std::string> names = simulation_names();
  if (std::find(names.begin(), names.end(), arguments.name) == names.end())
    throw Error(fmt::format("there is no simulation {}{} (there are: {})", quote(arguments.name),
                            did_you_mean(arguments.name, names), listed(names)));
  if (!arguments.out) throw Error("--out is needed: the folder that the scenario is written to");

  if (arguments.name == "dive") {
    DiveOptions options;
    set_common(arguments, options);
    if (arguments.grade) options.grade = parse_grade(*arguments.grade);
    if (arguments.latitude) options.latitude = number("--latitude", *arguments.latitude);
    if (arguments.keyframe_interval)
      options.keyframe_interval = number("--keyframe-interval", *arguments.keyframe_interval);
    if (arguments.surfacings) options.surfacings = parse_count("--surfacings", *arguments.surfacings);
    const OutputFolder out(*arguments.out);
    const SimulatedDive dive = simulate_dive(options);
    out.fill(dive_files(), [&](const std::filesystem::path& folder) { write_dive(dive, options, folder); });
  } else {
    DockingOptions options;
    set_common(arguments, options);
    refuse(arguments, arguments.grade, "--grade");
    refuse(arguments, arguments.latitude, "--latitude");
    refuse(arguments, arguments.keyframe_interval, "--keyframe-interval");
    refuse(arguments, arguments.surfacings, "--surfacings");
    const OutputFolder out(*arguments.out);
    const SimulatedDocking docking = simulate_docking(options);
    out.fill(docking_files(), [&](const std::filesystem::path& folder) { write_docking(docking, options, folder); });
  }
  fmt::print("Written to {}\n", *arguments.out);
  return 0;
}

}  // namespace tandem
