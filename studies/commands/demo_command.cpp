#include <cstdio>
#include <filesystem>
#include <numbers>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/studies/commands/demo_command.hpp>
#include <tandem/studies/demo/demo_fig3.hpp>
#include <tandem/studies/demo/demo_fig3_plots.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_folder.hpp>
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

int run_fig3(const DemoArguments& arguments) {
  const Solver solver = parse_solver("--solver", arguments.solver.value_or("gauss-newton"));
  const auto plots = parse_plots("--plots", arguments.plots.value_or("svg"));
  std::optional<OutputFolder> out;
  if (arguments.out) out.emplace(*arguments.out);

  std::vector<fig3::Solution> solutions;
  for (const fig3::Panel& panel : fig3::panels()) solutions.push_back(fig3::solve(panel, solver, kSeed));
  const std::string report = fig3_report(solutions);

  std::string note;  // about a picture that is missing
  if (out)
    out->fill({"fig3.txt", "fig3.svg", "fig3.png"}, [&](const std::filesystem::path& folder) {
      write_file(folder / "fig3.txt", report);
      if (plots) note = fig3::draw(solutions, *plots, folder);
    });
  fmt::print("{}", report);
  if (out) fmt::print("\nWritten to {}\n", *arguments.out);
  std::fflush(stdout);
  if (!note.empty()) fmt::print(stderr, "tandem: {}\n", note);
  for (const fig3::Solution& s : solutions) {
    if (s.summary.converged()) continue;
    fmt::print(stderr, "tandem: {} did not converge on {}: {}\n", s.summary.solver, s.panel.title, s.summary.message);
    return 2;
  }
  return 0;
}

}  // namespace

std::vector<std::string> demo_names() { return {"fig3"}; }

int run_demo(const DemoArguments& arguments) {
  if (arguments.name != "fig3")
    throw Error(fmt::format("there is no demo {}{} (there is: {})", quote(arguments.name),
                            did_you_mean(arguments.name, demo_names()), listed(demo_names())));
  return run_fig3(arguments);
}

}  // namespace tandem
