#include <cstdio>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <tandem/studies/builtin_scenarios.hpp>
#include <tandem/studies/command_line.hpp>
#include <tandem/studies/estimate_command.hpp>
#include <tandem/studies/text.hpp>
#include <tandem/studies/yaml_section.hpp>

namespace tandem {
namespace {

constexpr int kBadInput = 1;

void add_estimate(CLI::App& app, EstimateArguments& arguments) {
  CLI::App* command = app.add_subcommand("estimate", "Estimate the trajectories of chaser and target of a scenario");
  command->footer("Exit status: 0 converged, 1 wrong input or usage, 2 not converged (the best estimate is written).");
  const auto option = [&](const std::string& name, std::optional<std::string>& value, const std::string& takes,
                          const std::string& help) { command->add_option(name, value, help)->type_name(takes); };
  const auto repeatable = [&](const std::string& name, std::vector<std::string>& values, const std::string& takes,
                              const std::string& help) {
    command->add_option(name, values, help + "; repeatable")->type_name(takes)->allow_extra_args(false);
  };

  command->add_option("scenario", arguments.scenario, "A scenario folder, or the name of a built-in scenario")
      ->type_name("SCENARIO")
      ->required();
  option("--solver", arguments.solver, "NAME", "gauss-newton (default), ipopt or nlopt:ALGORITHM");
  option("--roll-pitch", arguments.roll_pitch, "soft|hard|off", "The target is level (default soft)");
  option("--non-holonomic", arguments.non_holonomic, "soft|hard|off", "The target has no sway, no heave (default off)");
  option("--surge", arguments.surge, "MIN,MAX", "Limits of the target's surge [m/s]; inf is none");
  option("--yaw-rate", arguments.yaw_rate, "MAX", "Limit of the target's yaw rate [rad/s]");
  option("--limits", arguments.limits, "hard|soft", "How surge and yaw rate are held (default hard)");
  option("--loss", arguments.loss, "NAME[:SCALE]",
         "Robust loss of the measurements: huber, cauchy, geman-mcclure or tukey; scale in sigmas (default 1)");
  repeatable("--noise", arguments.noise, "NAME=v,v,...", "Standard deviations in place of the scenario's");
  repeatable("--ipopt", arguments.ipopt, "KEY=VALUE", "An option of Ipopt's own");
  option("--hessian", arguments.hessian, "NAME",
         "For ipopt: automatic (default), gauss-newton, exact or limited-memory");
  option("--max-keyframes", arguments.max_keyframes, "N", "Take the first N keyframes only");
  option("--max-iterations", arguments.max_iterations, "N", "Stop after N iterations");
  option("--time-limit", arguments.time_limit, "SECONDS", "Stop after so long");
  option("--out", arguments.out, "DIR", "Write trajectories, errors, summary.json and plots to DIR");
  option("--plots", arguments.plots, "svg|png|off", "Format of the plots in DIR (default svg)");
  command->add_flag("--json", arguments.json, "Print summary.json, and nothing else");
  command->add_flag("--quiet", arguments.quiet, "Print no table, progress or notes");
}

void print_scenarios() {
  for (const std::string& name : scenario_names(builtin_scenarios())) {
    const YamlSection yaml = YamlSection::load(builtin_scenarios() / name / "scenario.yaml");
    fmt::print("{:<20} {}\n", name, yaml.has("description") ? yaml.text("description") : "");
  }
}

/// What is wrong with a command line, naming the near word where one is unknown.
std::string message(const CLI::ParseError& error, const CLI::App& app) {
  const CLI::App* command = app.get_subcommands().empty() ? &app : app.get_subcommands().front();
  if (const std::vector<std::string> extras = app.remaining(true); !extras.empty()) {
    std::vector<std::string> known;
    for (const CLI::Option* option : command->get_options()) known.push_back(option->get_name());
    for (const CLI::App* subcommand : command->get_subcommands({})) known.push_back(subcommand->get_name());
    const std::string word = extras.front().substr(0, extras.front().find('='));
    const char* const kind = word.starts_with("-") ? "option" : command == &app ? "command" : "argument";
    return fmt::format("unknown {} {}{}", kind, quote(word), did_you_mean(word, known));
  }
  const std::string text = error.what();
  const std::string help = command == &app ? "tandem --help" : "tandem " + command->get_name() + " --help";
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error)) {
    const bool repeated = text.find("At Most") != std::string::npos;
    return fmt::format("{} {} (see {})", text.substr(0, text.find(':')), repeated ? "is given twice" : "needs a value",
                       help);
  }
  return fmt::format("{} (see {})", text, help);
}

}  // namespace

int run_command_line(int argc, const char* const* argv, const std::string& version) try {
  CLI::App app("Joint estimation of a vehicle and the moving target it observes", "tandem");
  app.set_version_flag("--version", "tandem " + version);
  app.require_subcommand(1);
  EstimateArguments arguments;
  add_estimate(app, arguments);
  app.add_subcommand("scenarios", "List the built-in scenarios");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    fmt::print(stderr, "tandem: {}\n", message(error, app));
    return kBadInput;
  }
  if (app.got_subcommand("estimate")) return run_estimate(arguments);
  print_scenarios();
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "tandem: {}\n", error.what());
  return kBadInput;
}

}  // namespace tandem
