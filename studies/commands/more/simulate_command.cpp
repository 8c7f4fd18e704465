#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/simulation/dive_parameters.hpp>
#include <tandem/studies/simulation/docking_parameters.hpp>
#include <tandem/studies/simulation/simulate_dive_files.hpp>
#include <tandem/studies/simulation/simulate_docking_files.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

const char* const kOfDives = "Of a dive";
const char* const kOfDockings = "Of a docking";

/// Each option of a simulation is in what it simulates; those of both are in both.
struct SimulateRequest {
  std::string name;
  DiveOptions dive;
  DockingOptions docking;
  std::vector<std::pair<std::string, std::string>> set;  ///< parameters with their values
  Output output;
  bool force = false;
};

Grade parse_grade(const std::string& option, const std::string& text) {
  std::vector<std::string> names;
  for (const Grade grade : {Grade::mems, Grade::tactical}) {
    if (name(grade) == text) return grade;
    names.emplace_back(name(grade));
  }
  throw Error(fmt::format("{} is {}, not {}{}", option, listed(names, "or"), quote(text), did_you_mean(text, names)));
}

Results dive(const SimulateRequest& request) {
  const auto simulated = std::make_shared<const SimulatedDive>(simulate_dive(request.dive));
  Results results;
  results.write = [simulated, &request](const std::filesystem::path& folder) {
    write_dive(*simulated, request.dive, folder);
  };
  return results;
}

Results docking(const SimulateRequest& request) {
  const auto simulated = std::make_shared<const SimulatedDocking>(simulate_docking(request.docking));
  Results results;
  results.write = [simulated, &request](const std::filesystem::path& folder) {
    write_docking(*simulated, request.docking, folder);
  };
  return results;
}

template <class Options>
void set_parameter(const std::vector<NamedParameter<Options>>& parameters, const std::string& name,
                   const std::string& value, Options& options) {
  parameter_named(parameters, "--set", name).set(options, "--set " + name, value);
}

struct Simulation {
  std::string name, help;
  bool is_dive;
  Results (*run)(const SimulateRequest&);
};

const std::vector<Simulation>& simulations() {
  static const std::vector<Simulation> all = {{"dive", "a survey dive, by its own sensors alone", true, dive},
                                              {"docking", "a chaser and its target, as docking_a", false, docking}};
  return all;
}

/// A scenario is not to be mixed with what is there, nor another's written over.
void check_empty(const SimulateRequest& request) {
  const std::string& folder = request.output.folder_name;
  std::error_code none;
  if (request.force || !std::filesystem::is_directory(folder, none) || std::filesystem::is_empty(folder)) return;
  throw Error(fmt::format("--out {}: the folder is not empty; --force writes into it all the same", folder));
}

int run_simulate(const SimulateRequest& request, const CommandOptions& option) {
  std::vector<std::string> names;
  for (const Simulation& simulation : simulations()) {
    names.push_back(simulation.name);
    if (simulation.name != request.name) continue;
    if (const auto given = option.given(simulation.is_dive ? kOfDockings : kOfDives); !given.empty())
      throw Error(fmt::format("simulate {} takes no {}", request.name, given.front()));
    SimulateRequest set = request;
    for (const auto& [key, value] : request.set)
      if (simulation.is_dive)
        set_parameter(dive_parameters(), key, value, set.dive);
      else
        set_parameter(docking_parameters(), key, value, set.docking);
    check_empty(request);
    return finish(request.output, simulation.run(set));
  }
  throw Error(fmt::format("there is no simulation {}{} (there are: {})", quote(request.name),
                          did_you_mean(request.name, names), listed(names)));
}

}  // namespace

Command simulate_command() {
  std::vector<std::string> helps;
  for (const Simulation& simulation : simulations()) helps.push_back(simulation.name + ": " + simulation.help);
  return {[helps](CommandOptions& option) {
    const auto request = std::make_shared<SimulateRequest>();
    std::string footer = "The same options give the same numbers. Exit status: 0 written, 1 wrong input or usage.";
    footer += "\nParameters of a docking, of --set and --settings:";
    footer += parameter_help(docking_parameters());
    footer += "\nParameters of a dive, of --set:";
    footer += parameter_help(dive_parameters());
    option.footer(footer);
    option.argument("name", "NAME", fmt::format("{}", fmt::join(helps, "; ")), request->name);
    option.group(kOfDockings);
    option.set(
        "--settings", "FILE", "Parameters, NAME: VALUE lines of yaml; other options count after it",
        [&r = *request](const std::string&, const std::string& text) { read_docking_description(text, r.docking); });
    option.group("Options");
    option.set_repeatedly("--set", "NAME=VALUE", "A parameter, see below",
                          [&r = *request](const std::string& name, const std::string& text) {
                            r.set.push_back(parse_assignment(name, text));
                          });
    option.set("--minutes", "N", "How long it takes (default 20)",
               [&r = *request](const std::string& name, const std::string& text) {
                 r.dive.minutes = r.docking.minutes = parse_finite(name, text);
               });
    option.set("--seed", "N", "Of all noise, a whole number above zero (default 1)",
               [&r = *request](const std::string& name, const std::string& text) {
                 r.dive.seed = r.docking.seed = static_cast<std::uint64_t>(parse_count(name, text));
               });
    option.group(kOfDives);
    DiveOptions& dive = request->dive;
    option("--grade", "NAME", "Its sensors, mems (default) or tactical", dive.grade, parse_grade);
    option("--latitude", "DEG", "Where, for the Earth's rotation and gravity (default 60)", dive.latitude,
           parse_finite);
    option("--keyframe-interval", "S", "As written to scenario.yaml (default 1)", dive.keyframe_interval, parse_finite);
    option("--surfacings", "N", "How often it comes up for GPS on the way (default never)", dive.surfacings,
           parse_count);
    add_output(option, request->output,
               {.writes = "The folder to write", .required = true, .plots = false, .prints = false});
    option.flag("--force", "Write into DIR though it is not empty", request->force);
    return [request, &option] { return run_simulate(*request, option); };
  }};
}

}  // namespace tandem
