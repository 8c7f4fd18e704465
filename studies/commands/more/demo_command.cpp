#include <filesystem>
#include <numbers>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/demo/demo_fig3.hpp>
#include <tandem/studies/demo/demo_fig3_files.hpp>
#include <tandem/studies/demo/demo_modes.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr unsigned kSeed = 194;  // of the initial guesses: one that shows them well apart

double degrees(double radians) { return radians * 180.0 / std::numbers::pi; }

std::string fig3_table(const fig3::Solution& s) {
  std::string text = fmt::format("\n{}: {} in {} iterations, cost {:.6g} → {:.1e}\n", s.panel.title,
                                 name(s.summary.status), s.summary.iterations, s.summary.initial_cost, s.summary.cost);
  const auto line = [](const auto&... cells) {
    return fmt::format("{:>4} {:>6} {:>16} {:>16} {:>17} {:>18} {:>18}\n", cells...);
  };
  text += line("pose", "t [s]", "x [m]", "y [m]", "heading [°]", "off the arc [m]", "off tangent [°]");
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

struct DemoRequest {
  std::string name;
  Solver solver;
  Output output;
};

int run_fig3(const DemoRequest& request) {
  std::vector<fig3::Solution> solutions;
  for (const fig3::Panel& panel : fig3::panels()) solutions.push_back(fig3::solve(panel, request.solver, kSeed));
  const std::string report = fig3_report(solutions);

  Results results;
  results.table = [&] { return report; };
  results.plots_of = "demo";
  results.write = [&](const std::filesystem::path& folder) {
    write_file(folder / "fig3.txt", report);
    fig3::write_poses(solutions, folder);
  };
  for (const fig3::Solution& s : solutions)
    if (!s.summary.converged() && results.not_done.empty())
      results.not_done = fmt::format("{}: {}", s.panel.title, why_not_converged(s.summary));
  return finish(request.output, results);
}

/// Table I, and Figures 6 and 7, by all data; Figure 1 as data come.
int run_modes(const DemoRequest& request) {
  const Scenario scenario = read_scenario(builtin_scenarios() / "docking_a");
  const bool newest = request.name == "fig1";
  std::vector<modes::Instant> instants =
      newest ? modes::as_data_come(scenario) : modes::by_all_data(scenario, request.solver);
  const std::string report = fmt::format(
      "docking_a, Mode A and Mode B of Baxter & Teran Espinoza et al. 2025, {}\n"
      "Errors of the target relative to the chaser, mean ± standard deviation\n\n{}",
      newest ? "the newest estimate of each keyframe as data come" : "by all data", modes::table1(instants));
  if (newest) instants = modes::about_the_longest_gap(instants);
  Results results;
  results.table = [&] { return report; };
  results.plots_of = "demo";
  results.write = [&](const std::filesystem::path& folder) {
    write_file(folder / (request.name + ".txt"), report);
    modes::write_instants(instants, folder / (request.name + ".csv"));
  };
  return finish(request.output, results);
}

struct Demo {
  std::string name, help;
  int (*run)(const DemoRequest& request);
};

const std::vector<Demo>& demos() {
  static const std::vector<Demo> all = {
      {"fig3", "poses that the constant-twist prior alone puts on an arc", run_fig3},
      {"table1", "errors of raw measurements, Mode A and Mode B by keyframe type", run_modes},
      {"fig1", "both modes through a gap, as data come", run_modes},
      {"fig6", "both modes and the truth from above", run_modes},
      {"fig7", "errors of both modes with 3 σ over time", run_modes}};
  return all;
}

std::vector<std::string> demo_names() {
  std::vector<std::string> names;
  for (const Demo& demo : demos()) names.push_back(demo.name);
  return names;
}

int run_demo(const DemoRequest& request) {
  for (const Demo& demo : demos())
    if (demo.name == request.name) return demo.run(request);
  throw Error(fmt::format("there is no demo {}{} (there are: {})", quote(request.name),
                          did_you_mean(request.name, demo_names()), listed(demo_names())));
}

}  // namespace

Command demo_command() {
  return {[](CommandOptions& option) {
    const auto request = std::make_shared<DemoRequest>();
    option.footer("Exit status: 0 converged, 1 wrong input or usage, 2 not converged.");
    std::string help;
    for (const Demo& demo : demos()) help += fmt::format("{}{}: {}", help.empty() ? "" : "; ", demo.name, demo.help);
    option.argument("name", "NAME", help, request->name);
    add_solver(option, request->solver);
    add_threads(option);
    add_output(option, request->output, {.writes = "Write the table and a picture to DIR", .prints = false});
    return [request] { return run_demo(*request); };
  }};
}

}  // namespace tandem
