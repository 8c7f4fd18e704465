#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <tandem/studies/demo/demo_fig3_plots.hpp>
#include <tandem/studies/support/gnuplot.hpp>
#include <tandem/studies/support/palette.hpp>

namespace tandem::fig3 {
namespace {

constexpr double kArrow = 0.62, kTick = 0.25;       // length of the x and y axes of a pose [m]
constexpr double kLabel = 0.5;                      // of a pose's name from the arc, towards the centre [m]
constexpr int kPanel = 400, kGap = 30;              // of a panel, and between two [pixels]
constexpr int kLeft = 76, kTop = 40, kBelow = 114;  // around the panels [pixels]
constexpr int kKey = 44;                            // height of the key, at the bottom [pixels]

enum class Role { given, start, solved };
struct Look {
  Role role;
  const char* block;
  const char* colour;
  int point;
  const char* title;
};
constexpr Look kLooks[] = {{Role::start, "start", palette::orange, 8, "initial guess"},
                           {Role::given, "given", "black", 5, "given pose"},
                           {Role::solved, "solved", palette::blue, 7, "solved pose"}};

/// x, y, and the two axes as the plane shows them: one that points out of it is shorter.
std::string frame(const SE3& pose) {
  const Vector<3> p = pose.translation();
  const Matrix<3, 3> axes = pose.rotation().matrix();
  return fmt::format("{:.4f} {:.4f} {:.4f} {:.4f} {:.4f} {:.4f}\n", p.x(), p.y(), kArrow * axes(0, 0),
                     kArrow * axes(1, 0), kTick * axes(0, 1), kTick * axes(1, 1));
}

std::string frames(const Solution& s, Role role) {
  std::string lines;
  for (std::size_t k = 0; k < s.solved.size(); ++k)
    if (s.panel.poses[k].given == (role == Role::given)) lines += frame((role == Role::start ? s.start : s.solved)[k]);
  return lines.empty() ? "NaN NaN NaN NaN NaN NaN\n" : lines;
}

/// From each initial guess to where it was moved.
std::string moves(const Solution& s) {
  std::string lines;
  for (std::size_t k = 0; k < s.solved.size(); ++k) {
    const Vector<3> from = s.start[k].translation(), by = s.solved[k].translation() - from;
    lines += fmt::format("{:.4f} {:.4f} {:.4f} {:.4f}\n", from.x(), from.y(), by.x(), by.y());
  }
  return lines;
}

std::string names(const Solution& s) {
  std::string lines;
  for (std::size_t k = 0; k < s.solved.size(); ++k) {
    const Vector<3> p = s.solved[k].translation() * (1.0 - kLabel / radius);
    lines += fmt::format("{:.4f} {:.4f} T_{}\n", p.x(), p.y(), k);
  }
  return lines;
}

/// What every panel shows [m]: the circle and all poses, arrows included, with a margin.
Eigen::AlignedBox2d extent(const std::vector<Solution>& solutions) {
  Eigen::AlignedBox2d box(Eigen::Vector2d(-radius, -radius), Eigen::Vector2d(radius, radius));
  for (const Solution& s : solutions)
    for (const std::vector<SE3>* poses : {&s.start, &s.solved})
      for (const SE3& pose : *poses) {
        box.extend(pose.translation().head<2>());
        box.extend(pose.act({kArrow, 0, 0}).head<2>());
      }
  const Eigen::Vector2d margin(0.25, 0.25);
  return {box.min() - margin, box.max() + margin};
}

/// 3e-16 as 3×10⁻¹⁶.
std::string power_of_ten(double value) {
  const std::string text = fmt::format("{:.0e}", value);
  const std::size_t e = text.find('e');
  return fmt::format("{}×10^{{{}}}", text.substr(0, e), std::stoi(text.substr(e + 1)));
}

/// What the solve did: two lines, which fit into the circle.
std::string caption(const Solution& s) {
  const auto farthest = [](const std::vector<SE3>& poses) {
    double distance = 0.0;
    for (const SE3& pose : poses) distance = std::max(distance, off_arc(pose).distance);
    return distance;
  };
  return fmt::format("{:.1f} m → {} m\\noff the arc, in {} iterations", farthest(s.start),
                     power_of_ten(farthest(s.solved)), s.summary.iterations);
}

std::string panel_script(const Solution& s) {
  std::string script;
  for (const Look& look : kLooks) script += fmt::format("${} << EOD\n{}EOD\n", look.block, frames(s, look.role));
  script += fmt::format("$moves << EOD\n{}EOD\n$names << EOD\n{}EOD\n", moves(s), names(s));
  script += fmt::format(
      "set title '{}' font ',17' offset 0,-0.4\nset label 1 \"{}\" at 0,{} center tc rgb '#333333' font ',13'\n"
      "plot [0:2*pi] {}*cos(t), {}*sin(t) with lines lw 3 lc rgb '{}' notitle, "
      "$moves using 1:2:3:4 with vectors nohead dt 2 lw 1.3 lc rgb '{}' notitle, "
      "$names using 1:2:3 with labels boxed tc rgb '#333333' notitle",
      s.panel.title, caption(s), -0.3 * radius, radius, radius, palette::pale, palette::grey);
  for (const Look& look : kLooks)
    script += fmt::format(
        ", ${0} using 1:2:3:4 with vectors head filled size 0.16,20 lw 2 lc rgb '{1}' notitle, "
        "${0} using 1:2:5:6 with vectors nohead lw 2 lc rgb '{1}' notitle, "
        "${0} using 1:2 with points pt {2} ps 0.8 lw 2 lc rgb '{1}' notitle",
        look.block, look.colour, look.point);
  return script + "\n";
}

/// The key, for all panels, as a plot of its own that shows nothing else.
std::string key_script(double height) {
  std::string script = fmt::format(
      "reset\nset lmargin at screen 0\nset rmargin at screen 1\nset bmargin at screen 0\nset tmargin at screen {}\n"
      "unset border\nunset tics\nset key center center horizontal maxrows 1 reverse Left samplen 2 width 1\n"
      "plot [0:1][0:1] NaN with lines lw 3 lc rgb '{}' title 'constant twist'",
      kKey / height, palette::pale);
  for (const Look& look : kLooks)
    script +=
        fmt::format(", NaN with points pt {} ps 0.9 lw 2 lc rgb '{}' title '{}'", look.point, look.colour, look.title);
  return script + "\n";
}

std::string script(const std::vector<Solution>& solutions, PlotFormat format) {
  const Eigen::AlignedBox2d box = extent(solutions);
  const double width = kLeft + static_cast<int>(solutions.size()) * (kPanel + kGap);
  const double height = kTop + std::round(kPanel * box.sizes().y() / box.sizes().x()) + kBelow;
  std::string script = fmt::format(
      "set terminal {} size {},{} font 'Helvetica,15' background rgb 'white' enhanced\n"
      "set multiplot\nset parametric\nset samples 361\nset size ratio -1\nunset key\n"
      "set style textbox opaque noborder margins 0.5,0.5\n"
      "set border 3 lc rgb '#555555'\nset tics nomirror tc rgb '#333333' 1\nset grid lc rgb '#eeeeee' lt 1\n"
      "set xrange [{}:{}]\nset yrange [{}:{}]\nset xlabel 'x [m]'\nset ylabel 'y [m]'\n"
      "set tmargin at screen {}\nset bmargin at screen {}\n",
      format == PlotFormat::svg ? "svg fontscale 1.2" : "pngcairo pointscale 1.5", width, height, box.min().x(),
      box.max().x(), box.min().y(), box.max().y(), 1 - kTop / height, kBelow / height);
  double left = kLeft;
  for (const Solution& solution : solutions) {
    script +=
        fmt::format("set lmargin at screen {}\nset rmargin at screen {}\n", left / width, (left + kPanel) / width);
    script += panel_script(solution) + "unset ylabel\nset format y ''\n";
    left += kPanel + kGap;
  }
  return script + key_script(height) + "unset multiplot\n";
}

}  // namespace

std::string draw(const std::vector<Solution>& solutions, PlotFormat format, const std::filesystem::path& folder) {
  return run_gnuplot(script(solutions, format), folder / (format == PlotFormat::svg ? "fig3.svg" : "fig3.png"));
}

}  // namespace tandem::fig3
