#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <tandem/studies/estimation/error_plot.hpp>
#include <tandem/studies/support/palette.hpp>

namespace tandem {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr KeyframeType kTypes[] = {KeyframeType::gated, KeyframeType::usbl, KeyframeType::optical};

/// One component of the relative pose: its signed errors and 3 σ, at the keyframes, where they exist.
struct Component {
  std::string label;
  std::vector<std::optional<double>> error, bound;

  bool empty() const {
    const auto there = [](const std::optional<double>& x) { return x.has_value(); };
    return std::none_of(error.begin(), error.end(), there) && std::none_of(bound.begin(), bound.end(), there);
  }
  /// Nothing can move in it: out of the plane.
  bool always_zero() const {
    const auto zero = [](const std::optional<double>& x) { return std::abs(x.value_or(0.0)) < 1e-12; };
    return std::all_of(error.begin(), error.end(), zero) && std::all_of(bound.begin(), bound.end(), zero);
  }
};

/// x, y, z and heading, without those that are nowhere or always zero.
std::vector<Component> components(const Estimate& estimate) {
  std::vector<Component> result;
  const Vector<3> axes = estimate.frame.body(Vector<3>(1, 1, 1));
  const auto add = [&](const std::string& label, const auto& error, const auto& bound) {
    Component c{label, {}, {}};
    for (const KeyframeError& e : estimate.errors) c.error.push_back(error(e));
    for (const KeyframeUncertainty& u : estimate.uncertainty) c.bound.push_back(bound(u));
    if (!c.empty() && !c.always_zero()) result.push_back(std::move(c));
  };
  using Value = std::optional<double>;
  for (int i = 0; i < 3; ++i)
    add(
        fmt::format("{} [m]", "xyz"[i]),
        [&](const KeyframeError& e) { return e.position_vector ? Value(axes[i] * (*e.position_vector)[i]) : Value(); },
        [&](const KeyframeUncertainty& u) { return Value(3 * u.position_sigma()[i]); });
  add(
      "heading [°]",
      [&](const KeyframeError& e) {
        return e.rotation_vector ? Value(kDegrees * axes.z() * e.rotation_vector->z()) : Value();
      },
      [&](const KeyframeUncertainty& u) {
        const auto sigma = u.rotation_sigma();
        return sigma ? Value(3 * kDegrees * sigma->z()) : Value();
      });
  return result;
}

/// The value below which `share` of the given ones are; 0 of none.
double quantile(const std::vector<std::optional<double>>& given, double share) {
  std::vector<double> values;
  for (const auto& value : given)
    if (value && std::isfinite(*value)) values.push_back(std::abs(*value));
  if (values.empty()) return 0;
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// What the vertical axis shows: nearly all errors, and the band but for its widest stretches, far from any measurement.
/// Where σ spans decades, as between acoustic and optical phases, the scale is linear up to `linear` and logarithmic on.
struct Axis {
  double limit;
  bool cut;
  std::optional<double> linear{};
};

Axis axis(const Estimate& estimate, const Component& c) {
  std::vector<std::optional<double>> measured;  // bounds where there is a measurement
  for (std::size_t k = 0; k < c.bound.size(); ++k)
    if (estimate.keyframes[k].type != KeyframeType::gated) measured.push_back(c.bound[k]);
  if (quantile(measured, 1.0) == 0) measured = c.bound;
  const double most = std::max(quantile(c.error, 1.0), quantile(c.bound, 1.0));
  const double shown = std::max({quantile(c.error, 0.99), quantile(measured, 0.95), 1e-9});
  Axis result = most > 1.3 * shown ? Axis{1.3 * shown, true} : Axis{1.05 * std::max(most, 1e-9), false};
  const double least = quantile(measured, 0.05);
  if (least > 0 && shown > 8 * least) result.linear = least;
  return result;
}

/// gnuplot's commands for it.
std::string axis_script(const Axis& axis, const std::string& label) {
  std::string note, scale = "unset nonlinear y\nset ytics autofreq\n";
  if (axis.linear) {
    scale = fmt::format("set nonlinear y via asinh(y/{0}) inverse {0}*sinh(y)\nset ytics (0", *axis.linear);
    const auto place = [&](double y) { return std::asinh(y / *axis.linear); };
    double last = 0;
    for (double decade = std::pow(10.0, std::floor(std::log10(*axis.linear))); decade < axis.limit; decade *= 10)
      for (const double y : {decade, 2 * decade, 5 * decade})
        if (y < axis.limit && place(y) > last + 0.22 * place(axis.limit)) {
          scale += fmt::format(", {0:g}, -{0:g}", y);
          last = place(y);
        }
    scale += ")\n";
    note = "log scale";
  }
  if (axis.cut) note += note.empty() ? "cut" : ", cut";
  if (!note.empty()) note = "\\n{/*0.8 (" + note + ")}";
  return scale + fmt::format("set yrange [{}:{}]\nset ylabel \"{}{}\"\n", -axis.limit, axis.limit, label, note);
}

/// t, −3 σ, 3 σ; a gap where there is none.
std::string band(const Estimate& estimate, const Component& c) {
  std::string lines;
  for (std::size_t k = 0; k < c.bound.size(); ++k)
    lines += c.bound[k] ? fmt::format("{:.3f} {:.5g} {:.5g}\n", estimate.keyframes[k].t, -*c.bound[k], *c.bound[k])
                        : std::string("\n");
  return lines;
}

/// t, error.
std::string points(const Estimate& estimate, const Component& c, KeyframeType type) {
  std::string lines;
  for (std::size_t k = 0; k < c.error.size(); ++k)
    if (estimate.keyframes[k].type == type && c.error[k])
      lines += fmt::format("{:.3f} {:.5g}\n", estimate.keyframes[k].t, *c.error[k]);
  return lines;
}

/// Points of each type of keyframe from its own block, column `column`; the key is apart, since its points are larger.
std::string typed_points(const std::string& suffix, int column, bool key) {
  std::string text = fmt::format(
      "$gated{4} using 1:{0} with points pt 7 ps 0.3 lc rgb '{1}' notitle, "
      "$usbl{4} using 1:{0} with points pt 9 ps 0.55 lc rgb '{2}' notitle, "
      "$optical{4} using 1:{0} with points pt 7 ps 0.3 lc rgb '{3}' notitle",
      column, palette::grey, palette::vermilion, palette::blue, suffix);
  if (key)
    text += fmt::format(
        ", keyentry with points pt 9 ps 0.8 lc rgb '{1}' title 'USBL', "
        "keyentry with points pt 7 ps 0.6 lc rgb '{2}' title 'optical', "
        "keyentry with points pt 7 ps 0.6 lc rgb '{0}' title 'gated'",
        palette::grey, palette::vermilion, palette::blue);
  return text;
}

/// t, position error, orientation error of the keyframes of one type.
std::string norms_of(const Estimate& estimate, KeyframeType type) {
  std::string lines;
  for (const KeyframeError& error : estimate.errors)
    if (error.type == type && error.position)
      lines += fmt::format("{:.3f} {:.6g} {}\n", error.t, std::max(*error.position, 1e-9),
                           error.angle ? fmt::format("{:.6g}", *error.angle) : "NaN");
  return lines;
}

std::string multiplot(std::size_t panels, int height) {
  return fmt::format("set multiplot layout {},1 margins 0.11,0.97,{},{} spacing {}\n", panels, 60.0 / height,
                     1.0 - 60.0 / height, 30.0 / height);
}

}  // namespace

std::string error_bands_script(const Estimate& estimate, PlotFormat format) {
  const std::vector<Component> shown = components(estimate);
  if (shown.empty()) return "";
  const bool truth = summarise(estimate.errors).compared > 0, bands = !estimate.uncertainty.empty();
  std::string script;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    script += points_block(fmt::format("band{}", i), band(estimate, shown[i]));
    for (const KeyframeType type : kTypes)
      script += points_block(fmt::format("{}{}", name(type), i), points(estimate, shown[i], type));
  }
  const int height = 120 + 170 * static_cast<int>(shown.size());
  const std::string title = truth ? "error of the relative pose, by component" : "uncertainty of the relative pose";
  script += figure_style(format, height, estimate.scenario + ": " + title) + multiplot(shown.size(), height);
  script += fmt::format("set xrange [{}:{}]\nset style fill transparent solid 0.13 noborder\nset format x ''\n",
                        estimate.keyframes.front().t, estimate.keyframes.back().t);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    if (i == 1) script += "unset label 1\nunset key\n";
    if (i + 1 == shown.size()) script += "set format x '%g'\nset xlabel 't [s]'\n";
    script += axis_script(axis(estimate, shown[i]), shown[i].label) + "plot ";
    if (bands)
      script += fmt::format("$band{} using 1:2:3 with filledcurves lc rgb '{}' title '±3 σ'{}", i, palette::blue,
                            truth ? ", " : "\n");
    if (truth) script += typed_points(fmt::format("{}", i), 2, i == 0) + "\n";
  }
  return script + "unset multiplot\n";
}

std::string error_norms_script(const Estimate& estimate, PlotFormat format) {
  const ErrorSummary all = summarise(estimate.errors);
  if (all.compared == 0) return "";
  std::string script;
  for (const KeyframeType type : kTypes) script += points_block(std::string(name(type)), norms_of(estimate, type));
  const std::size_t panels = all.angle ? 2 : 1;
  const int height = all.angle ? 660 : 400;
  script += figure_style(format, height, estimate.scenario + ": error at each keyframe") + multiplot(panels, height);
  script += "set logscale y\nset format y '%g'\nset ylabel 'position error [m]'\n";
  if (!all.angle) return script + "set xlabel 't [s]'\nplot " + typed_points("", 2, true) + "\nunset multiplot\n";
  return script + "set format x ''\nplot " + typed_points("", 2, true) +
         "\nunset label 1\nunset key\nset format x '%g'\nset xlabel 't [s]'\nunset logscale y\nset yrange [0:*]\n"
         "set ylabel 'orientation error [°]'\nplot " +
         typed_points("", 3, false) + "\nunset multiplot\n";
}

}  // namespace tandem
