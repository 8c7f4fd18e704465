#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/more/planning_options.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/planning/plan_scenario.hpp>
#include <tandem/studies/planning/rendezvous_study.hpp>
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

/// Above zero; inf too.
double parse_time_constant(const std::string& option, const std::string& text) {
  return text == "inf" ? HUGE_VAL : parse_positive(option, text);
}

/// Where the library that draws it is missing, a simulation's other results are there without it.
void write_page(const RendezvousStudy& study, const std::filesystem::path& folder) {
  std::string page;
  try {
    page = rendezvous_page(study);
  } catch (const Error& error) {
    complain(fmt::format("rendezvous.html is not written: {}", error.what()));
    return;
  }
  write_file(folder / "rendezvous.html", page);
}

int run_rendezvous_command(const RendezvousRequest& request) {
  const Vehicle vehicle = read_vehicle(request.vehicle);
  RendezvousOptions options = request.options;
  options.stop = &interrupted();
  pursue_within(options.planner, vehicle);
  std::size_t done = 0;
  const RendezvousStudy study = study_rendezvous(
      vehicle, options, request.methods, request.seeds, [&](RendezvousMethod method, const RendezvousRun& run) {
        ++done;
        if (request.output.shows_progress())
          complain(fmt::format("{}, seed {}: {} after {:.1f} s, {} plans of {} shifted", name(method), run.seed,
                               name(run.outcome), run.seconds, run.shifted, run.plans));
        return !interrupted();
      });

  Results results;
  results.table = [&] { return report(study); };
  results.json = [&] { return rendezvous_json(study); };
  results.plots_of = "rendezvous";
  results.write = [&](const std::filesystem::path& folder) {
    write_rendezvous(study, folder);
    if (request.output.plots) write_page(study, folder);
  };
  if (done < request.methods.size() * std::size_t(request.seeds))
    results.not_done = "interrupted; what there is, counts";
  return finish(request.output, results);
}

}  // namespace

Command rendezvous_command() {
  return {[](CommandOptions& option) {
            const auto request = std::make_shared<RendezvousRequest>();
            RendezvousOptions& o = request->options;
            option.footer("Exit status: 0 simulated, whatever the outcome, 1 wrong input or usage, 2 interrupted.");
            option("--vehicle", "NAME|FILE", "The chaser: remus_100 (default), bluerov2_heavy, or a yaml file",
                   request->vehicle, [](const std::string&, const std::string& text) { return text; });
            option("--methods", "LIST", "Of decoupled (default), information, coupled and pursuit", request->methods,
                   parse_methods);
            option("--seeds", "N", "Runs of each method (default 1)", request->seeds, parse_count);
            option.set("--seed", "N", "The first one (default 1)",
                       [&o](const std::string& name, const std::string& text) {
                         o.seed = static_cast<std::uint64_t>(parse_count(name, text));
                       });
            option("--time-limit", "S", "Of a run (default 300)", o.time_limit, parse_positive);
            option("--target-speed", "M/S", "Of the target (default 0.8)", o.target_speed, parse_magnitude);
            option("--current", "M/S", "Standard deviation of the current's components (default 0.1)", o.current,
                   parse_magnitude);
            option("--start-distance", "M", "Of the two (default 30)", o.start_distance, parse_positive);
            option.group("Plan");
            option("--horizon", "S", "How far ahead to plan [s] (default 20)", o.horizon, parse_positive);
            option("--turn-time", "S",
                   "In which the target's turn rate is forgotten: damped twist (default 10; inf: constant twist)",
                   o.turn_time, parse_time_constant);
            option("--keep-out", "M", "Least distance until docking (default 3)", o.keep_out, parse_magnitude);
            add_chance(option, o.chance);
            option("--information", "WEIGHT", "Of a nat that is expected to be missed, by that method (default 0.1)",
                   o.information, parse_magnitude);
            add_plan_solver(option, o.planner);
            add_threads(option);
            add_output(option, request->output, {.writes = "Write every run and plots to DIR"});
            return [request] { return run_rendezvous_command(*request); };
          },
          true};
}

}  // namespace tandem
