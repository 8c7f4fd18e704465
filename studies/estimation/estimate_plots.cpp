#include <algorithm>

#include <fmt/format.h>

#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/studies/estimation/error_plot.hpp>
#include <tandem/studies/estimation/estimate_plots.hpp>
#include <tandem/studies/support/gnuplot.hpp>
#include <tandem/studies/support/palette.hpp>

namespace tandem {
namespace {

constexpr std::size_t kMostPoints = 5000;  // in a line: a figure shows no more

/// Every so manieth keyframe, so that figures stay small.
std::size_t stride(const Estimate& estimate) { return estimate.keyframes.size() / kMostPoints + 1; }

std::string xy(const Vector<3>& p) { return fmt::format("{:.4f} {:.4f}\n", p.x(), p.y()); }

std::string chaser_path(const Estimate& estimate) {
  std::string lines;
  for (std::size_t k = 0; k < estimate.chaser.size(); k += stride(estimate))
    lines += xy(estimate.chaser[k].translation());
  return lines;
}

std::string target_path(const Estimate& estimate) {
  std::string lines;
  for (std::size_t k = 0; k < estimate.target.size(); k += stride(estimate)) lines += xy(estimate.target[k].position);
  return lines;
}

std::string true_path(const std::vector<Stamped<SE3>>& truth, const Estimate& estimate) {
  std::string lines;
  for (std::size_t k = 0; k < estimate.keyframes.size(); k += stride(estimate))
    if (const auto pose = pose_at(truth, estimate.keyframes[k].t)) lines += xy(pose->translation());
  return lines;
}

/// Where the measurements put the target, seen from the estimated chaser.
std::string measured(const Estimate& estimate, KeyframeType type) {
  std::string lines;
  for (std::size_t k = 0; k < estimate.keyframes.size(); ++k)
    if (const Keyframe& keyframe = estimate.keyframes[k]; keyframe.type == type && keyframe.measured_position)
      lines += xy(estimate.chaser[k].act(*keyframe.measured_position));
  return lines;
}

/// What a map shows: the trajectories with a margin, not too flat, and the height [pixels] at equal scales.
struct Extent {
  Eigen::AlignedBox2d box;
  int height;
};

Extent extent(const Estimate& estimate) {
  Eigen::AlignedBox2d box;
  for (const SE3& pose : estimate.chaser) box.extend(pose.translation().head<2>());
  for (const TargetState& target : estimate.target) box.extend(target.position.head<2>());
  const Eigen::Vector2d size = box.sizes(), centre = box.center();
  const double margin = 0.04 * size.maxCoeff() + 0.5;  // m
  const double width = std::max(size.x() + 2.0 * margin, size.y());
  const double height = std::max(size.y() + 2.0 * margin, 0.3 * width);
  const Eigen::Vector2d half(0.5 * width, 0.5 * height);
  return {{centre - half, centre + half}, static_cast<int>(0.86 * kFigureWidth * height / width) + 138};
}

std::string trajectories_script(const Estimate& estimate, const Scenario& scenario, PlotFormat format) {
  const auto both = [](const SE3& chaser, const TargetState& target) {
    return xy(chaser.translation()) + xy(target.position);
  };
  const auto [box, height] = extent(estimate);
  std::string script = points_block("chaser", chaser_path(estimate)) + points_block("target", target_path(estimate)) +
                       points_block("usbl", measured(estimate, KeyframeType::usbl)) +
                       points_block("optical", measured(estimate, KeyframeType::optical)) +
                       points_block("true_chaser", true_path(scenario.truth_chaser, estimate)) +
                       points_block("true_target", true_path(scenario.truth_target, estimate)) +
                       points_block("starts", both(estimate.chaser.front(), estimate.target.front())) +
                       points_block("ends", both(estimate.chaser.back(), estimate.target.back()));
  script += figure_style(format, height, estimate.scenario + ": trajectories seen from above");
  script += fmt::format(
      "set tmargin at screen {}\nset bmargin at screen {}\nset size ratio -1\n"
      "set xrange [{}:{}]\nset yrange [{}:{}]\nset xlabel 'x [m]'\nset ylabel 'y [m]'\nplot ",
      1.0 - 78.0 / height, 60.0 / height, box.min().x(), box.max().x(), box.min().y(), box.max().y());
  if (scenario.has_truth())
    script += fmt::format(
        "$true_chaser using 1:2 with lines lw 4 lc rgb '{0}' title 'truth', "
        "$true_target using 1:2 with lines lw 4 lc rgb '{0}' notitle, ",
        palette::pale);
  return script + fmt::format(
                      "$usbl using 1:2 with points pt 7 ps 0.3 lc rgb '{2}' notitle, "
                      "$optical using 1:2 with points pt 7 ps 0.2 lc rgb '{3}' notitle, "
                      "$chaser using 1:2 with lines lw 1.2 lc rgb '{0}' title 'chaser', "
                      "$target using 1:2 with lines lw 1.2 lc rgb '{1}' title 'target', "
                      "keyentry with points pt 7 ps 0.5 lc rgb '{2}' title 'USBL fix', "
                      "keyentry with points pt 7 ps 0.5 lc rgb '{3}' title 'optical fix', "
                      "$starts using 1:2 with points pt 6 ps 1.2 lw 1.5 lc rgb 'black' title 'start', "
                      "$ends using 1:2 with points pt 5 ps 0.9 lc rgb 'black' title 'end'\n",
                      palette::blue, palette::vermilion, palette::orange, palette::sky_blue);
}

}  // namespace

std::string draw_plots(const Estimate& estimate, const Scenario& scenario, PlotFormat format,
                       const std::filesystem::path& folder) {
  const std::string extension = format == PlotFormat::svg ? ".svg" : ".png";
  for (const auto& [name, script] : {std::pair{"trajectories", trajectories_script(estimate, scenario, format)},
                                     {"errors", error_bands_script(estimate, format)},
                                     {"error_norms", error_norms_script(estimate, format)}}) {
    if (script.empty()) continue;
    const std::string complaint = run_gnuplot(script, folder / (name + extension));
    if (!complaint.empty()) return complaint;
  }
  return "";
}

}  // namespace tandem
