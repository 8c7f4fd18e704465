#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/problem/quantile.hpp>
#include <tandem/studies/report/plot_parts.hpp>
#include <tandem/studies/report/run_figures.hpp>
#include <tandem/studies/report/run_maps.hpp>
#include <tandem/studies/report/time_panels.hpp>

namespace tandem {
namespace {

using plot::Json;

bool any_finite(const std::vector<double>& values) {
  return std::any_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

/// Returns the quantile of the finite absolute values; 0 if there are none.
double quantile_of(std::vector<double> values, double share) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return 0;
  for (double& v : values) v = std::abs(v);
  return detail::quantile(std::move(values), share);
}

/// Returns the types of the run's keyframes with measurements, in the order of tables.
std::vector<std::string> measured_types(const RunRecord& run) {
  std::vector<std::string> types;
  for (const char* type : {"position", "pose", "partial"})
    if (std::find(run.types.begin(), run.types.end(), type) != run.types.end()) types.emplace_back(type);
  return types;
}

/// Labels the rows of a panel of strips.
void label_rows(const std::vector<std::string>& names, Json& axis) {
  Json rows = Json::array();
  for (std::size_t row = 0; row < names.size(); ++row) rows.push_back(row);
  axis["range"] = {double(names.size()) - 0.4, -0.6};
  axis["tickvals"] = std::move(rows);
  axis["ticktext"] = names;
  axis["showgrid"] = false;
}

HtmlFigure figure_of_errors(const RunRecord& run, const plot::TimeAxis& time) {
  constexpr const char* kTitles[] = {"x [m]", "y [m]", "z [m]", "yaw [°]"};
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i < 4; ++i)
    if (quantile_of(run.error[i], 1) > 1e-12) shown.push_back(i);
  const std::vector<std::string> types = measured_types(run);
  std::vector<double> shares(shown.size(), 1.0);
  if (!types.empty()) shares.push_back(0.15 + 0.15 * double(types.size()));
  plot::TimePanels panels(time, shares, int(170 * shares.size()));
  for (const std::size_t i : shown) {
    Json& axis = panels.panel(kTitles[i]);
    // The few huge bounds far from measurements do not decide the range.
    const double most = std::max(1.5 * quantile_of(run.three_sigma[i], 0.95), 1.1 * quantile_of(run.error[i], 0.99));
    std::vector<double> half = run.three_sigma[i];
    for (double& v : half) v = std::min(v, 3 * most);  // unobservable components have infinite bounds
    axis["range"] = {plot::number(-most), plot::number(most)};
    panels.band(run.t, half, plot::translucent(5));
    panels.line("", run.t, run.error[i], plot::colour(0), 1);
  }
  if (!types.empty()) {
    label_rows(types, panels.panel(""));
    for (std::size_t row = 0; row < types.size(); ++row) {
      std::vector<double> t;
      for (std::size_t k = 0; k < run.types.size(); ++k)
        if (run.types[k] == types[row]) t.push_back(run.t[k]);
      panels.ticks("", t, double(row), plot::colour(row == 0 ? 0 : 1 + row));
    }
  }
  if (!run.has_target())
    return panels.figure("Errors of the position over time",
                         "Estimate minus truth along the world's axes, with ±3 σ bounds (shaded).");
  return panels.figure(
      "Errors of the relative position over time",
      "Estimate minus truth along the chaser's axes, with ±3 σ bounds (shaded). The strips at the "
      "bottom show the keyframes with a measured position, a measured pose, or a partial measurement.");
}

/// Returns the standard deviations, without the few huge ones before the first measurements.
HtmlFigure figure_of_uncertainty(const RunRecord& run, const plot::TimeAxis& time) {
  const bool both = !run.position_sigma.empty() && !run.rotation_sigma.empty();
  plot::TimePanels panels(time, std::vector<double>(both ? 2 : 1, 1.0), both ? 420 : 240);
  for (const auto& [curves, title] :
       {std::pair{&run.position_sigma, "σ of position [m]"}, {&run.rotation_sigma, "σ of heading [°]"}}) {
    if (curves->empty()) continue;
    Json& axis = panels.panel(title);
    axis["type"] = "log";
    axis["exponentformat"] = "none";
    axis["nticks"] = 5;
    std::size_t n = 0;
    for (const RunRecord::Curve& curve : *curves) {
      Json& trace = panels.line(curve.name, curve.t, curve.value, plot::colour(n++));
      if (curves == &run.rotation_sigma) trace["line"]["dash"] = "dash";
    }
  }
  return panels.figure("Uncertainty over time",
                       "Standard deviations that the run states. Horizontal and relative: root of the summed "
                       "variances. A line ends where the data do not determine the state.");
}

HtmlFigure figure_of_range(const RunRecord& run, const plot::TimeAxis& time) {
  plot::TimePanels panels(time, {1, 1}, 400);
  for (const auto& [curves, title] :
       {std::pair{&run.range, "range [m]"},
        {&run.bearing, run.is_ned ? "bearing to starboard [°]" : "bearing to port [°]"}}) {
    Json& axis = panels.panel(title);
    axis["rangemode"] = curves == &run.range ? "tozero" : "normal";
    for (std::size_t i = curves->size(); i-- > 1;) {
      const RunRecord::Curve& fixes = (*curves)[i];
      panels.points(fixes.name + " fix", fixes.t, fixes.value, i == 1 ? plot::kGrey : plot::colour(i), 4);
    }
    const RunRecord::Curve& estimate = curves->front();
    Json& trace = panels.line(estimate.name, estimate.t, estimate.value, plot::colour(1));
    if (curves != &run.bearing) continue;
    trace["mode"] = "markers";  // a line would cross the panel where the bearing passes ±180°
    trace["marker"] = {{"size", 2.5}, {"color", plot::colour(1)}};
    trace["showlegend"] = false;
    axis["nticks"] = 7;
  }
  return panels.figure("Range and bearing of the target",
                       "Seen from the chaser, whose x axis points to bearing 0. Fixes are measured, the line is "
                       "estimated.");
}

std::vector<std::string> sensors_of(const RunRecord& run) {
  std::vector<std::string> names;
  for (const RunRecord::Residuals& of : run.residuals) names.push_back(of.sensor);
  return different(names);
}

std::string colour_of(const std::string& outcome) {
  return outcome == "used"            ? plot::colour(0)
         : outcome == "down-weighted" ? plot::colour(4)
         : outcome == "rejected"      ? plot::colour(1)
                                      : plot::colour(2);
}

HtmlFigure figure_of_measurements(const RunRecord& run, const plot::TimeAxis& time) {
  const std::vector<std::string> sensors = sensors_of(run);
  plot::TimePanels panels(time, {1}, int(40 + 26 * sensors.size()));
  label_rows(sensors, panels.panel(""));
  for (const char* outcome : {"used", "held-out", "down-weighted", "rejected"})
    for (std::size_t row = 0; row < sensors.size(); ++row) {
      std::vector<double> t;
      for (const RunRecord::Residuals& of : run.residuals)
        if (of.sensor == sensors[row] && of.outcome == outcome) t.insert(t.end(), of.t.begin(), of.t.end());
      std::sort(t.begin(), t.end());
      t.erase(std::unique(t.begin(), t.end()), t.end());
      if (!t.empty()) panels.ticks(outcome, t, double(row), colour_of(outcome));
    }
  return panels.figure("Measurements over time", "Rejected: not used, since they contradict the others.");
}

HtmlFigure figure_of_residuals(const RunRecord& run, const plot::TimeAxis& time) {
  constexpr double kLimit = 6;  // expected standard deviations; larger residuals are drawn at the edge
  std::vector<std::pair<std::string, std::string>> rows;
  for (const RunRecord::Residuals& of : run.residuals)
    if (any_finite(of.value) && std::find(rows.begin(), rows.end(), std::pair{of.sensor, of.component}) == rows.end())
      rows.emplace_back(of.sensor, of.component);
  plot::TimePanels panels(time, std::vector<double>(rows.size(), 1.0),
                          int(100 * std::max<std::size_t>(2, rows.size())));
  for (const auto& [sensor, component] : rows) {
    Json& axis = panels.panel(run.is_online() ? sensor : sensor + " " + component);
    axis["range"] = {run.is_online() ? 0 : -kLimit - 0.5, kLimit + 0.5};
    axis["tickvals"] = {-3, 0, 3};
    axis["title"]["font"] = {{"size", 10}};
    for (const double level : {-3.0, 3.0}) panels.level(level);
    for (const RunRecord::Residuals& of : run.residuals) {
      if (of.sensor != sensor || of.component != component) continue;
      std::vector<double> value = of.value;
      for (double& v : value) v = std::isfinite(v) ? std::clamp(v, -kLimit, kLimit) : v;
      const bool used = of.outcome == "used";
      Json& trace = panels.points(of.outcome, of.t, value, colour_of(of.outcome), used ? 3 : 6, used ? "circle" : "x");
      trace["customdata"] = plot::numbers(of.value);
      trace["hovertemplate"] = "%{x}: %{customdata} σ<extra></extra>";
    }
  }
  if (run.is_online())
    return panels.figure("Innovations",
                         "Innovation of each measurement in standard deviations, which the gate tests. Beyond 6: at "
                         "the edge.");
  return panels.figure("Residuals over time",
                       "Measurement minus estimate in expected standard deviations, by sensor and component. Mean 0, "
                       "standard deviation 1 and no pattern if the noise is as stated; dotted: ±3. Beyond ±6: at the "
                       "edge, with the value on hover.");
}

HtmlFigure figure_of_distribution(const RunRecord& run) {
  Json traces = Json::array();
  std::size_t i = 0;
  for (const char* type : {"position", "pose", "none", "partial"}) {
    std::vector<double> values;
    for (std::size_t k = 0; k < run.types.size(); ++k)
      if (run.types[k] == type && std::isfinite(run.position_error[k])) values.push_back(run.position_error[k]);
    if (!values.empty()) traces.push_back(plot::cumulative(type, values, plot::colour(i)));
    ++i;
  }
  Json layout = plot::layout("size of the relative position's error [m]", "share of keyframes");
  layout["xaxis"]["type"] = "log";
  return {"Distribution of errors",
          "Cumulative share of keyframes by error, for each type of measurement at the keyframe.", traces, layout, 380};
}

}  // namespace

plot::TimeAxis time_axis(const RunRecord& run) { return {run.start, run.duration()}; }

std::vector<HtmlFigure> run_figures(const RunRecord& run) {
  const plot::TimeAxis time = time_axis(run);
  std::vector<HtmlFigure> figures = {figure_from_above(run)};
  if (!run.range.empty()) figures.push_back(figure_of_range(run, time));
  if (!run.position_sigma.empty() || !run.rotation_sigma.empty()) figures.push_back(figure_of_uncertainty(run, time));
  if (!run.residuals.empty()) {
    figures.push_back(figure_of_measurements(run, time));
    if (std::any_of(run.residuals.begin(), run.residuals.end(), [](const auto& of) { return any_finite(of.value); }))
      figures.push_back(figure_of_residuals(run, time));
  }
  if (run.has_truth()) figures.push_back(figure_of_errors(run, time));
  if (run.has_truth() && !run.types.empty()) figures.push_back(figure_of_distribution(run));
  if (!is_planar(run)) {
    figures.push_back(figure_of_height(run, time));
    figures.push_back(figure_in_space(run));
  }
  return figures;
}

}  // namespace tandem
