#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <tandem/studies/navigation/navigation_plots.hpp>
#include <tandem/studies/support/gnuplot.hpp>
#include <tandem/studies/support/palette.hpp>

namespace tandem {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr std::size_t kMostPoints = 5000;  // in a line: a figure shows no more

std::size_t stride(const NavigationStudy& study) { return study.navigation.states.size() / kMostPoints + 1; }

std::string xy(const Vector<3>& p) { return fmt::format("{:.4f} {:.4f}\n", p.x(), p.y()); }

/// What a map shows: the tracks with a margin, not too flat, and the height [pixels] at equal scales.
struct Extent {
  Eigen::AlignedBox2d box;
  int height;
};

Extent extent(const Eigen::AlignedBox2d& box) {
  const Eigen::Vector2d size = box.sizes(), centre = box.center();
  const double margin = 0.04 * size.maxCoeff() + 0.5;  // m
  const double height = std::max(size.y() + 2 * margin, 0.3 * (size.x() + 2 * margin));
  const double width = std::max(size.x() + 2 * margin, 0.9 * height);
  const Eigen::Vector2d half(0.5 * width, 0.5 * height);
  return {{centre - half, centre + half}, static_cast<int>(0.86 * kFigureWidth * height / width) + 138};
}

/// East right and north up, whatever the scenario's axes are called.
std::string track_script(const NavigationStudy& study, PlotFormat format) {
  const Navigation& navigation = study.navigation;
  const NavigationComparison& comparison = study.comparison;
  Eigen::AlignedBox2d box;
  std::string estimate, truth, fixes;
  for (std::size_t k = 0; k < navigation.states.size(); k += stride(study)) {
    const auto& [t, state] = navigation.states[k];
    const Vector<3> p = state.pose.act(comparison.point);
    estimate += xy(p);
    box.extend(p.head<2>());
    if (const auto pose = pose_at(study.scenario.truth_chaser, t)) {
      const Vector<3> q = (comparison.to_estimate * *pose).translation();
      truth += xy(q);
      box.extend(q.head<2>());
    }
  }
  for (const EgoSensor& sensor : navigation.data.sensors)
    if (sensor.type == EgoSensorType::gps)
      for (const EgoMeasurement& m : sensor.measurements) fixes += xy(m.value);
  const auto [shown, height] = extent(box);
  const auto at = [&](const Stamped<EgoState>& state) { return xy(state.value.pose.act(comparison.point)); };
  std::string script = points_block("estimate", estimate) + points_block("truth", truth) +
                       points_block("fixes", fixes) + points_block("start", at(navigation.states.front())) +
                       points_block("end", at(navigation.states.back()));
  script += figure_style(format, height, study.scenario.name + ": track seen from above");
  const bool ned = study.scenario.frame.is_ned();
  script += fmt::format(
      "set tmargin at screen {}\nset bmargin at screen {}\nset size ratio -1\n"
      "set xrange [{}:{}]\nset yrange [{}:{}]\nset xlabel '{}'\nset ylabel '{}'\nplot ",
      1.0 - 78.0 / height, 60.0 / height, shown.min().x(), shown.max().x(), shown.min().y(), shown.max().y(),
      ned ? "y (east) [m]" : "x (east) [m]", ned ? "x (north) [m]" : "y (north) [m]");
  if (!truth.empty())
    script += fmt::format("$truth using 1:2 with lines lw 4 lc rgb '{}' title 'truth', ", palette::pale);
  if (!fixes.empty())
    script += fmt::format(
        "$fixes using 1:2 with points pt 7 ps 0.35 lc rgb '{0}' notitle, "
        "keyentry with points pt 7 ps 0.6 lc rgb '{0}' title 'GPS fix', ",
        palette::orange);
  return script + fmt::format(
                      "$estimate using 1:2 with lines lw 1.4 lc rgb '{}' title 'estimate', "
                      "$start using 1:2 with points pt 6 ps 1.2 lw 1.5 lc rgb 'black' title 'start', "
                      "$end using 1:2 with points pt 5 ps 0.9 lc rgb 'black' title 'end'\n",
                      palette::blue);
}

/// One component over the keyframes: error and 3 σ, where they exist.
struct Component {
  std::string label;
  std::vector<std::optional<double>> error, bound;

  bool empty() const {
    const auto there = [](const std::optional<double>& x) { return x.has_value(); };
    return std::none_of(error.begin(), error.end(), there) && std::none_of(bound.begin(), bound.end(), there);
  }
};

/// Position along the scenario's world axes, then roll, pitch and yaw, without those that are nowhere.
std::vector<Component> components(const NavigationStudy& study) {
  const Frame& frame = study.scenario.frame;
  std::vector<Component> result;
  const auto add = [&](const std::string& label, int axis, double unit, const Matrix<3, 3>& axes, const auto& error,
                       const auto& sigma) {
    Component c{label, {}, {}};
    const auto& all = study.comparison.errors;
    for (std::size_t k = 0; k < all.size(); k += stride(study)) {
      c.error.emplace_back();
      c.bound.emplace_back();
      if (all[k].*error) c.error.back() = unit * axes.row(axis).dot(*(all[k].*error));
      if (all[k].*sigma) c.bound.back() = 3 * unit * axes.row(axis).cwiseAbs().dot(*(all[k].*sigma));
    }
    if (!c.empty()) result.push_back(std::move(c));
  };
  for (int i = 0; i < 3; ++i)
    add(fmt::format("{} [m]", "xyz"[i]), i, 1, frame.world_axes(), &NavigationError::position,
        &NavigationError::position_sigma);
  for (int i = 0; i < 3; ++i)
    add(std::array{"roll [°]", "pitch [°]", "yaw [°]"}[std::size_t(i)], i, kDegrees, frame.body_axes(),
        &NavigationError::attitude, &NavigationError::attitude_sigma);
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

/// 1, 2 or 5 times a power of ten, so that one to three tics are on either side of zero.
double tics(double limit) {
  const double decade = std::pow(10.0, std::floor(std::log10(limit / 1.5)));
  for (const double step : {5.0, 2.0})
    if (step * decade <= limit / 1.5) return step * decade;
  return decade;
}

/// All errors, and the bands but for their widest stretches, as before a heading is known.
std::string axis_script(const Component& c) {
  const double most = std::max(quantile(c.error, 1), quantile(c.bound, 1));
  const double shown = std::max({1.1 * quantile(c.error, 1), 1.3 * quantile(c.bound, 0.9), 1e-9});
  const double limit = most > shown ? shown : 1.05 * std::max(most, 1e-9);
  const std::string note = most <= limit
                               ? "unset label 2\n"
                               : "set label 2 'cut' at graph 0.995,0.9 right font ',10' textcolor rgb '#777777'\n";
  return fmt::format("set yrange [{}:{}]\nset ytics {:g}\nset ylabel \"{}\"\n{}", -limit, limit, tics(limit), c.label,
                     note);
}

std::string errors_script(const NavigationStudy& study, PlotFormat format) {
  const std::vector<Component> shown = components(study);
  if (shown.empty()) return "";
  const auto& states = study.navigation.states;
  const bool truth = std::any_of(study.comparison.errors.begin(), study.comparison.errors.end(),
                                 [](const NavigationError& e) { return e.position.has_value(); });
  const bool bands = !study.navigation.covariance.empty();
  std::string script;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    std::string band, error;
    for (std::size_t k = 0; k < shown[i].error.size(); ++k) {
      const double t = study.comparison.errors[k * stride(study)].t;
      const auto& [e, b] = std::pair(shown[i].error[k], shown[i].bound[k]);
      band += b ? fmt::format("{:.3f} {:.5g} {:.5g}\n", t, -*b, *b) : std::string("\n");
      error += e ? fmt::format("{:.3f} {:.5g}\n", t, *e) : std::string("\n");  // a gap in the line
    }
    script += points_block(fmt::format("band{}", i), band) + points_block(fmt::format("error{}", i), error);
  }
  const int height = 120 + 150 * static_cast<int>(shown.size());
  script += figure_style(format, height,
                         study.scenario.name + (truth ? ": errors by component" : ": uncertainty by component"));
  script += fmt::format("set multiplot layout {},1 margins 0.11,0.97,{},{} spacing {}\n", shown.size(), 60.0 / height,
                        1.0 - 60.0 / height, 26.0 / height);
  script += fmt::format("set xrange [{}:{}]\nset style fill transparent solid 0.13 noborder\nset format x ''\n",
                        states.front().t, states.back().t);
  for (std::size_t n = 0; n < study.comparison.outages.size(); ++n) {
    const GpsOutage& outage = study.comparison.outages[n];
    script += fmt::format(
        "set object {} rectangle from {},graph 0 to {},graph 1 fillcolor rgb '#f2f2f2' fillstyle solid 1 noborder "
        "behind\n",
        n + 1, outage.from, outage.to);
  }
  for (std::size_t i = 0; i < shown.size(); ++i) {
    if (i == 1) script += "unset label 1\nunset key\n";
    if (i + 1 == shown.size()) script += "set format x '%g'\nset xlabel 't [s]'\n";
    script += axis_script(shown[i]) + "plot ";
    if (bands)
      script += fmt::format("$band{} using 1:2:3 with filledcurves lc rgb '{}' title '±3 σ'{}", i, palette::blue,
                            truth ? ", " : "");
    if (truth && !shown[i].empty())
      script += fmt::format("$error{} using 1:2 with lines lw 1.2 lc rgb '{}' title 'error'", i, palette::vermilion);
    if (i == 0 && !study.comparison.outages.empty())
      script += ", keyentry with boxes fc rgb '#dddddd' fs solid 1 noborder title 'without GPS'";
    script += "\n";
  }
  return script + "unset multiplot\n";
}

}  // namespace

std::string draw_navigation(const NavigationStudy& study, PlotFormat format, const std::filesystem::path& folder) {
  const std::string extension = format == PlotFormat::svg ? ".svg" : ".png";
  for (const auto& [name, script] :
       {std::pair{"navigation", track_script(study, format)}, {"errors", errors_script(study, format)}}) {
    if (script.empty()) continue;
    const std::string complaint = run_gnuplot(script, folder / (name + extension));
    if (!complaint.empty()) return complaint;
  }
  return "";
}

}  // namespace tandem
