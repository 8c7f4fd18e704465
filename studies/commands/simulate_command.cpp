#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/simulation/dive_parameters.hpp>
#include <tandem/studies/simulation/docking_parameters.hpp>
#include <tandem/studies/simulation/simulate_dive_files.hpp>
#include <tandem/studies/simulation/simulate_docking_files.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

const char* const kDiveOptions = "Dive";
const char* const kDockingOptions = "Docking";

/// Values of the options. Options of both simulations are stored in both members.
struct SimulateRequest {
  std::string name;
  DiveOptions dive;
  DockingOptions docking;
  std::vector<std::pair<std::string, std::string>> set;  ///< names and values of parameters
  Output output;
};

Grade parse_grade(const std::string& option, const std::string& text) {
  std::vector<std::string> names;
  for (const Grade grade : {Grade::mems, Grade::tactical}) {
    if (name(grade) == text) return grade;
    names.emplace_back(name(grade));
  }
  throw Error(
      fmt::format("{} takes {}, not {}{}", option, listed(names, "or"), quote(text), did_you_mean(text, names)));
}

/// A written scenario.
struct Written {
  std::string simulation, folder;
  std::uint64_t seed;
  nlohmann::ordered_json parameters;
};

JsonFields<Written> written_fields() {
  return JsonFields<Written>()
      .add("simulation", "dive or docking", [](const Written& w) { return w.simulation; })
      .add("folder", "the written scenario folder", [](const Written& w) { return w.folder; })
      .add("seed", "random seed", [](const Written& w) { return w.seed; })
      .add("parameters", "all parameters of the simulation, by name", [](const Written& w) { return w.parameters; });
}

/// Returns the values of all parameters by name; numbers as numbers.
template <class Options>
nlohmann::ordered_json parameters_json(const std::vector<NamedParameter<Options>>& parameters, const Options& options) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const NamedParameter<Options>& parameter : parameters) {
    const std::string text = parameter.text(options);
    if (const auto number = parse_number(text))
      json[parameter.name] = *number;
    else
      json[parameter.name] = text;
  }
  return json;
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
  static const std::vector<Simulation> all = {
      {"dive", "a survey dive of a chaser with its own sensors", true, dive},
      {"docking", "a chaser and its target, like the built-in scenario docking_a", false, docking}};
  return all;
}

/// Throws Error if the output folder is not empty, unless --force is given. Prevents a mix of two scenarios.
void check_empty(const SimulateRequest& request) {
  const std::string& folder = request.output.folder_name;
  std::error_code none;
  if (request.output.force || !std::filesystem::is_directory(folder, none) || std::filesystem::is_empty(folder)) return;
  throw Error(fmt::format("--out {}: the folder is not empty; use --force to write to it", folder));
}

int run_simulate(const SimulateRequest& request, const CommandOptions& option) {
  std::vector<std::string> names;
  for (const Simulation& simulation : simulations()) {
    names.push_back(simulation.name);
    if (simulation.name != request.name) continue;
    if (const auto given = option.given(simulation.is_dive ? kDockingOptions : kDiveOptions); !given.empty())
      throw Error(fmt::format("simulate {} does not take {}", request.name, given.front()));
    SimulateRequest set = request;
    for (const auto& [key, value] : request.set)
      if (simulation.is_dive)
        set_parameter(dive_parameters(), key, value, set.dive);
      else
        set_parameter(docking_parameters(), key, value, set.docking);
    check_empty(request);
    Results results = simulation.run(set);
    results.json = [&] {
      return json_text(json_document("simulate", written_fields(),
                                     Written{set.name, set.output.folder_name, set.docking.seed,
                                             simulation.is_dive ? parameters_json(dive_parameters(), set.dive)
                                                                : parameters_json(docking_parameters(), set.docking)}));
    };
    return finish(request.output, results);
  }
  throw Error(fmt::format("unknown simulation {}{} (available: {})", quote(request.name),
                          did_you_mean(request.name, names), listed(names)));
}

}  // namespace

Command simulate_command() {
  std::vector<std::string> helps;
  for (const Simulation& simulation : simulations()) helps.push_back(simulation.name + ": " + simulation.help);
  return {[helps](CommandOptions& option) {
            const auto request = std::make_shared<SimulateRequest>();
            option.footer("Equal options give equal data. --help-all lists the parameters of --set.");
            option.details("Parameters of a docking, for --set and --settings:" + parameter_help(docking_parameters()) +
                           "\nParameters of a dive, for --set:" + parameter_help(dive_parameters()));
            option.exit_status("Exit status: 0 written, 1 invalid input or usage.");
            option.argument("name", "NAME", fmt::format("{}", fmt::join(helps, "; ")), request->name);
            option.group(kDockingOptions);
            option.set("--settings", "FILE",
                       "Read parameters from a YAML file with NAME: VALUE lines; other options override them",
                       [&r = *request](const std::string&, const std::string& text) {
                         read_docking_description(text, r.docking);
                       });
            option.group("Options");
            option.set_repeatedly("--set", "NAME=VALUE", "Set a parameter of the simulation",
                                  [&r = *request](const std::string& name, const std::string& text) {
                                    r.set.push_back(parse_assignment(name, text));
                                  });
            option.set("--minutes", "N", "Duration [min] (default 20)",
                       [&r = *request](const std::string& name, const std::string& text) {
                         r.dive.minutes = r.docking.minutes = parse_finite(name, text);
                       });
            option.set("--seed", "N", "Random seed, a positive integer (default 1)",
                       [&r = *request](const std::string& name, const std::string& text) {
                         r.dive.seed = r.docking.seed = static_cast<std::uint64_t>(parse_count(name, text));
                       });
            option.group(kDiveOptions);
            DiveOptions& dive = request->dive;
            option("--grade", "NAME", "Grade of the sensors: mems or tactical (default mems)", dive.grade, parse_grade);
            option("--latitude", "DEG", "Latitude, for gravity and the rotation of the Earth [deg] (default 60)",
                   dive.latitude, parse_finite);
            option("--keyframe-interval", "S", "Value of keyframe_interval to write to scenario.yaml [s] (default 1)",
                   dive.keyframe_interval, parse_finite);
            option("--surfacings", "N", "Number of surfacings for GPS fixes during the dive (default 0)",
                   dive.surfacings, parse_count);
            add_output(option, request->output,
                       {.writes = "Write the scenario folder to DIR",
                        .required = true,
                        .plots = false,
                        .force = &request->output.force});
            option.flag("--force",
                        "Write to DIR even if it is not empty, and overwrite files that tandem did not write",
                        request->output.force);
            return [request, &option] { return run_simulate(*request, option); };
          },
          false, [] { return std::vector{describe_json("--json", "simulate", written_fields())}; }};
}

TANDEM_COMMAND(simulate, "Files", "Write a simulated scenario folder: dive or docking")

}  // namespace tandem
