#include <algorithm>

#include <fmt/format.h>

#include <tandem/problem/trajectory.hpp>
#include <tandem/studies/gnuplot.hpp>
#include <tandem/studies/plots.hpp>

namespace tandem {
namespace {

// Okabe & Ito 2008: told apart with any kind of colour vision.
const char* const kBlue = "#0072B2";
const char* const kVermilion = "#D55E00";
const char* const kOrange = "#E69F00";
const char* const kSkyBlue = "#56B4E9";
const char* const kGrey = "#999999";
const char* const kPale = "#c4c4c4";

constexpr std::size_t kMostPoints = 5000;  // in a line: a figure shows no more
constexpr int kWidth = 900;                // of a figure [pixels]

/// Every so manieth keyframe, so that figures stay small.
std::size_t stride(const Estimate& estimate) { return estimate.keyframes.size() / kMostPoints + 1; }

/// How a figure looks: title and key above it on the left, light axes.
std::string style(PlotFormat format, int height, const std::string& title) {
  return fmt::format(
      "set terminal {} size {},{} font 'Helvetica,13' background rgb 'white'\n"
      "set label 1 {} at screen 0.02,screen {} noenhanced\n"
      "set key at screen 0.015,screen {} left top horizontal maxrows 1 reverse Left samplen 1.5 font ',12'\n"
      "set lmargin at screen 0.11\nset rmargin at screen 0.97\n"
      "set border 3 lc rgb '#555555'\nset tics nomirror tc rgb '#333333'\nset grid lc rgb '#e8e8e8' lt 1\n",
      format == PlotFormat::svg ? "svg" : "pngcairo", kWidth, height, gnuplot_string(title), 1.0 - 20.0 / height,
      1.0 - 32.0 / height);
}

/// Named points, which may be none.
std::string block(const std::string& name, const std::string& lines) {
  return fmt::format("${} << EOD\n{}EOD\n", name, lines.empty() ? "NaN NaN NaN\n" : lines);
}

std::string xy(const Vector<3>& p) { return fmt::format("{:.4f} {:.4f}\n", p.x(), p.y()); }

std::string path(const std::vector<SE3>& poses, std::size_t step) {
  std::string lines;
  for (std::size_t k = 0; k < poses.size(); k += step) lines += xy(poses[k].translation());
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
  for (const std::vector<SE3>* poses : {&estimate.chaser, &estimate.target})
    for (const SE3& pose : *poses) box.extend(pose.translation().head<2>());
  const Eigen::Vector2d size = box.sizes(), centre = box.center();
  const double margin = 0.04 * size.maxCoeff() + 0.5;  // m
  const double width = std::max(size.x() + 2.0 * margin, size.y());
  const double height = std::max(size.y() + 2.0 * margin, 0.3 * width);
  const Eigen::Vector2d half(0.5 * width, 0.5 * height);
  return {{centre - half, centre + half}, static_cast<int>(0.86 * kWidth * height / width) + 138};
}

std::string trajectories_script(const Estimate& estimate, const Scenario& scenario, PlotFormat format) {
  const auto both = [](const SE3& chaser, const SE3& target) {
    return xy(chaser.translation()) + xy(target.translation());
  };
  const auto [box, height] = extent(estimate);
  std::string script = block("chaser", path(estimate.chaser, stride(estimate))) +
                       block("target", path(estimate.target, stride(estimate))) +
                       block("usbl", measured(estimate, KeyframeType::usbl)) +
                       block("optical", measured(estimate, KeyframeType::optical)) +
                       block("true_chaser", true_path(scenario.truth_chaser, estimate)) +
                       block("true_target", true_path(scenario.truth_target, estimate)) +
                       block("starts", both(estimate.chaser.front(), estimate.target.front())) +
                       block("ends", both(estimate.chaser.back(), estimate.target.back()));
  script += style(format, height, estimate.scenario + ": trajectories seen from above");
  script += fmt::format(
      "set tmargin at screen {}\nset bmargin at screen {}\nset size ratio -1\n"
      "set xrange [{}:{}]\nset yrange [{}:{}]\nset xlabel 'x [m]'\nset ylabel 'y [m]'\nplot ",
      1.0 - 78.0 / height, 60.0 / height, box.min().x(), box.max().x(), box.min().y(), box.max().y());
  if (scenario.has_truth())
    script += fmt::format(
        "$true_chaser using 1:2 with lines lw 4 lc rgb '{0}' title 'truth', "
        "$true_target using 1:2 with lines lw 4 lc rgb '{0}' notitle, ",
        kPale);
  return script + fmt::format(
                      "$usbl using 1:2 with points pt 7 ps 0.3 lc rgb '{2}' notitle, "
                      "$optical using 1:2 with points pt 7 ps 0.2 lc rgb '{3}' notitle, "
                      "$chaser using 1:2 with lines lw 1.2 lc rgb '{0}' title 'chaser', "
                      "$target using 1:2 with lines lw 1.2 lc rgb '{1}' title 'target', "
                      "keyentry with points pt 7 ps 0.5 lc rgb '{2}' title 'USBL fix', "
                      "keyentry with points pt 7 ps 0.5 lc rgb '{3}' title 'optical fix', "
                      "$starts using 1:2 with points pt 6 ps 1.2 lw 1.5 lc rgb 'black' title 'start', "
                      "$ends using 1:2 with points pt 5 ps 0.9 lc rgb 'black' title 'end'\n",
                      kBlue, kVermilion, kOrange, kSkyBlue);
}

/// t, position error, orientation error of the keyframes of one type.
std::string errors_of(const Estimate& estimate, KeyframeType type) {
  std::string lines;
  for (const KeyframeError& error : estimate.errors)
    if (error.type == type && error.position)
      lines += fmt::format("{:.3f} {:.6g} {}\n", error.t, std::max(*error.position, 1e-9),
                           error.angle ? fmt::format("{:.6g}", *error.angle) : "NaN");
  return lines;
}

std::string errors_script(const Estimate& estimate, PlotFormat format) {
  std::string script;
  for (const KeyframeType type : {KeyframeType::gated, KeyframeType::usbl, KeyframeType::optical})
    script += block(std::string(name(type)), errors_of(estimate, type));
  const auto curves = [](int column) {
    return fmt::format(
        "plot $gated using 1:{0} with points pt 7 ps 0.3 lc rgb '{1}' notitle, "
        "$usbl using 1:{0} with points pt 9 ps 0.55 lc rgb '{2}' notitle, "
        "$optical using 1:{0} with points pt 7 ps 0.3 lc rgb '{3}' notitle, "
        "keyentry with points pt 9 ps 0.8 lc rgb '{2}' title 'USBL', "
        "keyentry with points pt 7 ps 0.6 lc rgb '{3}' title 'optical', "
        "keyentry with points pt 7 ps 0.6 lc rgb '{1}' title 'gated'\n",
        column, kGrey, kVermilion, kBlue);
  };
  const bool angles = summarise(estimate.errors).angle.has_value();
  const int height = angles ? 660 : 400;
  script += style(format, height, estimate.scenario + ": error at each keyframe");
  script += fmt::format("set multiplot layout {},1 margins 0.11,0.97,{},{} spacing 0.06\n", angles ? 2 : 1,
                        60.0 / height, 1.0 - 60.0 / height);
  script += "set logscale y\nset format y '%g'\nset ylabel 'position error [m]'\n";
  if (!angles) return script + "set xlabel 't [s]'\n" + curves(2) + "unset multiplot\n";
  return script + "set format x ''\n" + curves(2) +
         "unset label 1\nunset key\nset format x '%g'\nset xlabel 't [s]'\nunset logscale y\nset yrange "
         "[0:*]\n"
         "set ylabel 'orientation error [°]'\n" +
         curves(3) + "unset multiplot\n";
}

}  // namespace

std::string draw_plots(const Estimate& estimate, const Scenario& scenario, PlotFormat format,
                       const std::filesystem::path& folder) {
  const std::string extension = format == PlotFormat::svg ? ".svg" : ".png";
  std::string complaint =
      run_gnuplot(trajectories_script(estimate, scenario, format), folder / ("trajectories" + extension));
  if (complaint.empty() && summarise(estimate.errors).compared > 0)
    complaint = run_gnuplot(errors_script(estimate, format), folder / ("errors" + extension));
  return complaint;
}

}  // namespace tandem
