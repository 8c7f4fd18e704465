#include <filesystem>
#include <numbers>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/paper/paper_fig3.hpp>
#include <tandem/studies/paper/paper_fig3_files.hpp>
#include <tandem/studies/paper/paper_modes.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr unsigned kSeed = 194;  // random seed of the initial guesses; with it they do not overlap in the figure

double degrees(double radians) { return radians * 180.0 / std::numbers::pi; }

std::string fig3_table(const fig3::Solution& s) {
  std::string text = fmt::format("\n{}: {} in {} iterations, cost {:.6g} → {:.1e}\n", s.panel.title,
                                 name(s.summary.status), s.summary.iterations, s.summary.initial_cost, s.summary.cost);
  const auto line = [](const auto&... cells) {
    return fmt::format("{:>4} {:>6} {:>16} {:>16} {:>17} {:>18} {:>18}\n", cells...);
  };
  text += line("pose", "t [s]", "x [m]", "y [m]", "heading [°]", "arc error [m]", "heading error [°]");
  for (std::size_t k = 0; k < s.solved.size(); ++k) {
    const auto [t, given] = s.panel.poses[k];
    const SE3 &before = s.start[k], &after = s.solved[k];
    const auto cell = [given = given](double from, double to, int decimals) {
      return given ? fmt::format("{:.{}f}", to, decimals)
                   : fmt::format("{:.{}f} → {:.{}f}", from, decimals, to, decimals);
    };
    const auto off = [given = given](double from, double to) {
      return given ? std::string("given") : fmt::format("{:.2f} → {:.1e}", from, to);
    };
    const auto [distance_before, angle_before] = fig3::off_arc(before);
    const auto [distance_after, angle_after] = fig3::off_arc(after);
    text += line(k, fmt::format("{:.1f}", t), cell(before.translation().x(), after.translation().x(), 3),
                 cell(before.translation().y(), after.translation().y(), 3),
                 cell(degrees(heading(before.rotation())), degrees(heading(after.rotation())), 1),
                 off(distance_before, distance_after), off(degrees(angle_before), degrees(angle_after)));
  }
  return text;
}

std::string fig3_report(const std::vector<fig3::Solution>& solutions) {
  std::string text = fmt::format(
      "Figure 3 of Baxter & Teran Espinoza et al. 2025: the constant-twist prior on SE(3), by {}\n"
      "Surge {} m/s and yaw rate {} rad/s make an arc of radius {} m. Unknown poses: initial guess → solved.\n",
      solutions.front().summary.solver, fig3::speed, fig3::turn_rate, fig3::radius);
  for (const fig3::Solution& solution : solutions) text += fig3_table(solution);
  return text;
}

using Solutions = std::vector<fig3::Solution>;

JsonFields<Solutions> fig3_fields() {
  using S = fig3::Solution;
  return JsonFields<Solutions>()
      .add("figure", "fig3", [](const Solutions&) { return "fig3"; })
      .add_list(
          "panels", "panels of the figure",
          JsonFields<S>()
              .add("title", "title", [](const S& s) { return s.panel.title; })
              .add("solver", "name of the solver", [](const S& s) { return s.summary.solver; })
              .add("status", "converged, or why the solve ended", [](const S& s) { return name(s.summary.status); })
              .add("message", "explanation of the status", [](const S& s) { return s.summary.message; })
              .add("iterations", "number of iterations", [](const S& s) { return s.summary.iterations; })
              .add("initial_cost", "cost of the initial guess", [](const S& s) { return s.summary.initial_cost; })
              .add("cost", "final cost", [](const S& s) { return s.summary.cost; }),
          [](const Solutions& all) -> const Solutions& { return all; });
}

struct PaperRequest {
  std::string name;
  AnySolver solver;
  Output output;
};

int run_fig3(const PaperRequest& request) {
  std::vector<fig3::Solution> solutions;
  for (const fig3::Panel& panel : fig3::panels()) solutions.push_back(fig3::solve(panel, request.solver, kSeed));
  const std::string report = fig3_report(solutions);

  Results results;
  results.table = [&] { return report; };
  results.json = [&] { return json_text(json_document("paper", fig3_fields(), solutions)); };
  results.plots_command = "paper";
  results.write = [&](const std::filesystem::path& folder) {
    write_file(folder / "fig3.txt", report);
    fig3::write_poses(solutions, folder);
  };
  for (const fig3::Solution& s : solutions)
    if (!s.summary.converged() && results.incomplete_reason.empty())
      results.incomplete_reason = fmt::format("{}: {}", s.panel.title, why_not_converged(s.summary));
  return finish(request.output, results);
}

/// Runs Table I and Figures 6 and 7 (batch estimates), or Figure 1 (online estimates).
int run_modes(const PaperRequest& request) try {
  const Scenario scenario = read_scenario(builtin_scenarios() / "docking_a");
  const bool newest = request.name == "fig1";
  std::vector<modes::Instant> instants =
      newest ? modes::online_estimates(scenario) : modes::batch_estimates(scenario, request.solver);
  const std::string report = fmt::format(
      "docking_a, Mode A and Mode B of Baxter & Teran Espinoza et al. 2025, {}\n"
      "Errors of the target relative to the chaser, mean ± standard deviation\n\n{}",
      newest ? "online (newest estimate at each keyframe)" : "batch (all data)", modes::table1(instants));
  const std::string json = modes::json(request.name, instants);
  if (newest) instants = modes::around_longest_gap(instants);
  Results results;
  results.table = [&] { return report; };
  results.json = [&] { return json; };
  results.plots_command = "paper";
  results.write = [&](const std::filesystem::path& folder) {
    write_file(folder / (request.name + ".txt"), report);
    modes::write_instants(instants, folder / (request.name + ".csv"));
  };
  return finish(request.output, results);
} catch (const modes::NotConverged& error) {
  warn(error.what());
  return kIncomplete;
}

/// A figure or table of the paper.
struct Figure {
  std::string name, help;
  int (*run)(const PaperRequest& request);
};

const std::vector<Figure>& figures() {
  static const std::vector<Figure> all = {
      {"fig3", "poses on an arc, from the constant-twist prior alone", run_fig3},
      {"table1", "errors of raw measurements, Mode A and Mode B by keyframe type", run_modes},
      {"fig1", "both modes online, around the longest gap", run_modes},
      {"fig6", "both modes and the truth, seen from above", run_modes},
      {"fig7", "errors of both modes with 3σ bounds over time", run_modes}};
  return all;
}

std::vector<std::string> figure_names() {
  std::vector<std::string> names;
  for (const Figure& figure : figures()) names.push_back(figure.name);
  return names;
}

int run_figure(const PaperRequest& request) {
  for (const Figure& figure : figures())
    if (figure.name == request.name) return figure.run(request);
  throw Error(fmt::format("unknown figure {}{} (available: {})", quote(request.name),
                          did_you_mean(request.name, figure_names()), listed(figure_names())));
}

}  // namespace

Command paper_command() {
  return {[](CommandOptions& option) {
            const auto request = std::make_shared<PaperRequest>();
            std::string footer = "Figures and tables of Baxter & Teran Espinoza et al. 2025:";
            for (const Figure& figure : figures()) footer += fmt::format("\n  {:<8} {}", figure.name, figure.help);
            option.footer(footer);
            option.argument("name", "NAME", fmt::format("{}, see below", listed(figure_names(), "or")), request->name);
            add_solver(option, request->solver);
            add_threads(option);
            add_output(option, request->output, {.writes = "Write the table and the figure to DIR"});
            return [request] { return run_figure(*request); };
          },
          false,
          [] {
            std::vector<FileDescription> files = fig3::file_columns();
            files.push_back(modes::file_columns("NAME.csv"));
            files.push_back(describe_json("--json fig3", "paper", fig3_fields()));
            files.push_back(modes::json_keys());
            return files;
          }};
}

TANDEM_COMMAND(paper, "Studies", "Reproduce figures and tables of the paper: fig3, table1, fig1, fig6 or fig7")

}  // namespace tandem
