#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include <tandem/studies/comparison/compare_plots.hpp>
#include <tandem/studies/support/gnuplot.hpp>
#include <tandem/studies/support/palette.hpp>

namespace tandem {
namespace {

constexpr int kPanel = 390, kRow = 340, kKey = 320;  // pixels
constexpr double kFloor = 1e-10;                     // relative gap that counts as none

struct Look {
  std::string colour;
  int dash;
  double width;
};

/// A colour each family, a dash each member; NLopt, which has many, in pale lines behind.
Look look(const std::string& solver) {
  if (solver == "gauss-newton") return {palette::blue, 1, 2.5};
  if (solver == "augmented-lagrangian") return {palette::vermilion, 1, 2.5};
  static const std::vector<std::string> ipopt = {"ipopt", "ipopt:gauss-newton", "ipopt:exact", "ipopt:limited-memory"};
  if (const auto it = std::find(ipopt.begin(), ipopt.end(), solver); it != ipopt.end())
    return {palette::orange, static_cast<int>(it - ipopt.begin()) + 1, 2.0};
  static const char* const colours[] = {palette::sky_blue, palette::grey, "#009E73", "#CC79A7"};
  const std::vector<std::string> algorithms = nlopt_algorithms();
  const auto place = static_cast<std::size_t>(
      std::find(algorithms.begin(), algorithms.end(), solver.substr(solver.find(':') + 1)) - algorithms.begin());
  return {colours[place % 4], static_cast<int>(place / 4) + 1, 1.2};
}

/// A solve in a plot: the seconds and the relative distance from the best cost, of the best point so far where no hard
/// constraint says what else makes a point good.
std::string points(const ComparedSolve& s, double best) {
  const double scale = std::max(std::abs(best), 1e-12);
  std::string lines;
  double least = HUGE_VAL;
  for (const CurvePoint& p : s.curve) {
    if (!std::isfinite(p.cost)) continue;
    least = std::min(least, p.cost);
    const double from_best = std::abs((s.role == Role::hard ? p.cost : least) - best) / scale;
    lines += fmt::format("{:.6g} {:.6g}\n", std::max(p.seconds, 1e-5), std::max(from_best, kFloor));
  }
  return lines;
}

/// The bounds of a panel: outside, a fraction of the figure.
std::string place(std::size_t column, std::size_t columns, std::size_t row, std::size_t rows) {
  const double width = double(kPanel * columns + kKey), height = double(kRow * rows + 40);
  const double left = (kPanel * double(column) + 75) / width, right = (kPanel * double(column + 1) - 5) / width;
  const double top = 1 - (kRow * double(row) + 75) / height, bottom = 1 - (kRow * double(row + 1) - 20) / height;
  return fmt::format(
      "set lmargin at screen {}\nset rmargin at screen {}\nset tmargin at screen {}\nset bmargin at screen {}\n", left,
      right, top, bottom);
}

std::string panel(const std::vector<ComparedSolve>& solves) {
  std::string data, curves;
  const std::optional<double> best = best_cost(solves);
  for (std::size_t i = 0; best && i < solves.size(); ++i) {
    const ComparedSolve& s = solves[i];
    const std::string lines = points(s, *best);
    if (lines.empty()) continue;
    const Look l = look(s.solver);
    data += fmt::format("$s{} << EOD\n{}EOD\n", i, lines);
    curves += fmt::format(
        "{} $s{} using 1:2 with lines lw {} dt {} lc rgb '{}' notitle, $s{} using 1:2 every ::{} with points pt {} ps "
        "0.9 "
        "lw 1.5 lc rgb '{}' notitle",
        curves.empty() ? "plot" : ",", i, l.width, l.dash, l.colour, i,
        std::count(lines.begin(), lines.end(), '\n') - 1, s.converged() ? 7 : 2, l.colour);
  }
  const std::string title = fmt::format("{} keyframes, {}", solves.front().keyframes,
                                        solves.front().role == Role::off
                                            ? "no constraints"
                                            : fmt::format("{} constraints", constraints_name(solves.front().role)));
  return fmt::format("set title {} noenhanced offset 0,-0.5\n", gnuplot_string(title)) + data +
         (curves.empty() ? "plot NaN notitle" : curves) + "\n";
}

std::string script(const Comparison& comparison, PlotFormat format) {
  const auto problems = by_problem(comparison);
  std::set<std::size_t> sizes;
  for (const auto& solves : problems) sizes.insert(solves.front().keyframes);
  const std::size_t rows = std::max<std::size_t>(1, sizes.size());
  const std::size_t columns = (problems.size() + rows - 1) / rows;
  const double width = double(kPanel * columns + kKey), height = double(kRow * rows + 40);
  std::string text = fmt::format(
      "set terminal {} size {},{} font 'Helvetica,12' background rgb 'white'\n"
      "set multiplot\n"
      "set label 1 {} at screen {},screen {} noenhanced font ',13'\n"
      "set border 3 lc rgb '#555555'\nset tics nomirror tc rgb '#333333'\nset grid lc rgb '#e8e8e8' lt 1\n"
      "set logscale xy\nset format '10^{{%T}}'\nset xlabel 'seconds' offset 0,0.4\n",
      format == PlotFormat::svg ? "svg" : "pngcairo", width, height,
      gnuplot_string(comparison.scenario + ": relative distance of the cost from the best, against time"), 12 / width,
      1 - 18 / height);
  text += fmt::format("set yrange [{}:*]\nunset key\n", 0.5 * kFloor);
  std::set<std::string> drawn;
  for (std::size_t i = 0; i < problems.size(); ++i) {
    text += place(i % columns, columns, i / columns, rows);
    text += i % columns == 0 ? "set ylabel '|cost − best| / best' offset 1\n" : "unset ylabel\n";
    text += panel(problems[i]) + "unset label 1\n";
    for (const ComparedSolve& s : problems[i])
      if (!s.curve.empty()) drawn.insert(s.solver);
  }
  // One key for all, in the order of the solvers.
  text += fmt::format(
      "set lmargin at screen {}\nset rmargin at screen 0.999\nset tmargin at screen {}\nset bmargin at screen 0.01\n"
      "unset border\nunset tics\nunset grid\nunset title\nunset xlabel\nunset ylabel\nunset logscale\n"
      "set xrange [0:1]\nset yrange [0:1]\nset key left top Left reverse samplen 2.5 font ',11' noenhanced\nplot NaN "
      "notitle",
      (kPanel * double(columns) + 10) / width, 1 - 40 / height);
  for (const Contender& contender : contenders()) {
    if (!drawn.contains(contender.name)) continue;
    const Look l = look(contender.name);
    text += fmt::format(", NaN with lines lw {} dt {} lc rgb '{}' title {}", l.width, l.dash, l.colour,
                        gnuplot_string(contender.name));
  }
  text += ", keyentry with points pt 7 ps 0.9 lc rgb '#555555' title 'converged'";
  return text + ", keyentry with points pt 2 ps 0.9 lw 1.5 lc rgb '#555555' title 'stopped before'\nunset multiplot\n";
}

}  // namespace

std::string draw_comparison(const Comparison& comparison, PlotFormat format, const std::filesystem::path& folder) {
  return run_gnuplot(script(comparison, format), folder / (format == PlotFormat::svg ? "compare.svg" : "compare.png"));
}

}  // namespace tandem
