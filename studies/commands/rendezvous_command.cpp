#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/planning_options.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/planning/plan_scenario.hpp>
#include <tandem/studies/rendezvous/rendezvous_study.hpp>
#include <tandem/studies/report/rendezvous_page.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

struct RendezvousRequest {
  std::string vehicle = "remus_100";
  RendezvousOptions options;
  std::vector<RendezvousMethod> methods{RendezvousMethod::decoupled};
  int seeds = 1;
  Output output;
};

std::vector<RendezvousMethod> parse_methods(const std::string& option, const std::string& text) {
  std::vector<RendezvousMethod> methods;
  for (const std::string_view word : split(text, ','))
    methods.push_back(parse_rendezvous_method(option, std::string(word)));
  return methods;
}

/// Parses a positive number or "inf".
double parse_time_constant(const std::string& option, const std::string& text) {
  return text == "inf" ? HUGE_VAL : parse_positive(option, text);
}

/// Writes rendezvous.html. Only warns if it cannot be created, e.g. without plotly.js, so that the other results are
/// kept.
void write_page(const RendezvousStudy& study, const std::filesystem::path& folder) {
  std::string page;
  try {
    page = rendezvous_page(study);
  } catch (const Error& error) {
    warn(fmt::format("rendezvous.html was not written: {}", error.what()));
    return;
  }
  write_file(folder / "rendezvous.html", page);
}

int run_rendezvous_command(const RendezvousRequest& request) {
  const Vehicle vehicle = read_vehicle(request.vehicle);
  RendezvousOptions options = request.options;
  options.stop = &interrupted();
  options.planner.pursuit = pursuit_limits(vehicle);
  std::size_t done = 0;
  const RendezvousStudy study = study_rendezvous(
      vehicle, options, request.methods, request.seeds, [&](RendezvousMethod method, const RendezvousRun& run) {
        ++done;
        if (request.output.shows_progress())
          warn(fmt::format("{}, seed {}: {} after {:.1f} s, {} of {} plans are fallbacks", name(method), run.seed,
                           name(run.outcome), run.seconds, run.shifted, run.plans));
        return !interrupted();
      });

  Results results;
  results.table = [&] { return report(study); };
  results.json = [&] { return rendezvous_json(study); };
  results.plots_command = "rendezvous";
  results.write = [&](const std::filesystem::path& folder) {
    write_rendezvous(study, folder);
    if (request.output.plots) write_page(study, folder);
  };
  if (done < request.methods.size() * std::size_t(request.seeds))
    results.incomplete_reason = "interrupted; the results contain only the completed runs";
  return finish(request.output, results);
}

}  // namespace

Command rendezvous_command() {
  return {[](CommandOptions& option) {
            const auto request = std::make_shared<RendezvousRequest>();
            RendezvousOptions& o = request->options;
            option.exit_status(
                "Exit status: 0 all runs simulated (whether docked or not), 1 invalid input or usage, 2 interrupted.");
            option("--vehicle", "NAME|FILE", "Chaser: remus_100, bluerov2_heavy or a YAML file (default remus_100)",
                   request->vehicle, [](const std::string&, const std::string& text) { return text; });
            option("--methods", "LIST",
                   "Planning methods, comma-separated: decoupled, information, coupled, pursuit (default decoupled)",
                   request->methods, parse_methods);
            option("--seeds", "N", "Number of runs of each method (default 1)", request->seeds, parse_count);
            option.set("--seed", "N", "Seed of the first run; each further run adds 1 (default 1)",
                       [&o](const std::string& name, const std::string& text) {
                         o.seed = static_cast<std::uint64_t>(parse_count(name, text));
                       });
            option("--duration", "S", "Simulated time after which a run ends [s] (default 300)", o.time_limit,
                   parse_positive);
            option("--target-speed", "M/S", "Speed of the target [m/s] (default 0.8)", o.target_speed,
                   parse_non_negative);
            option("--current-sigma", "M/S",
                   "Standard deviation of the horizontal components of the current [m/s] (default 0.1)", o.current,
                   parse_non_negative);
            option("--start-distance", "M", "Initial distance between chaser and target [m] (default 30)",
                   o.start_distance, parse_positive);
            option.group("Plan");
            option("--horizon", "S", "Planning horizon [s] (default 20)", o.horizon, parse_positive);
            option.advanced();
            option("--turn-time", "S",
                   "Time constant of the target's turn rate in the damped-twist prediction [s]; inf for constant twist "
                   "(default 10)",
                   o.turn_time, parse_time_constant);
            option.everyday();
            option("--keep-out", "M", "Minimum distance between chaser and target until docking [m] (default 3)",
                   o.keep_out, parse_non_negative);
            option.advanced();
            add_chance_option(option, o.chance);
            option("--information", "WEIGHT",
                   "Method information: cost per nat of expected information that is missed (default 0.1)",
                   o.information, parse_non_negative);
            option.everyday();
            add_plan_solver_options(option, o.planner);
            add_threads(option);
            add_output(option, request->output, {.writes = "Write all runs and plots to DIR"});
            return [request] { return run_rendezvous_command(*request); };
          },
          true,
          [] {
            std::vector<FileDescription> files = rendezvous_file_columns();
            files.push_back(rendezvous_json_keys());
            return files;
          }};
}

TANDEM_COMMAND(rendezvous, "Planning", "Simulate rendezvous: measure, estimate, plan and act until docked")

}  // namespace tandem
