#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include <tandem/problem/quantile.hpp>
#include <tandem/studies/report/plot_parts.hpp>
#include <tandem/studies/report/run_figures.hpp>

namespace tandem {
namespace {

using plot::Json;

struct NamedPath {
  const char* name;
  const RunRecord::Path* path;
  std::string colour;
  const char* dash;
};

std::vector<NamedPath> paths_of(const RunRecord& run) {
  std::vector<NamedPath> all;
  for (const NamedPath& p : {NamedPath{"chaser", &run.chaser, plot::colour(0), "solid"},
                             {"chaser, truth", &run.chaser_truth, plot::colour(5), "dot"},
                             {"target", &run.target, plot::colour(1), "solid"},
                             {"target, truth", &run.target_truth, plot::colour(4), "dot"}})
    if (!p.path->t.empty()) all.push_back(p);
  return all;
}

/// Returns the different words of a list, in the order of their first occurrence.
std::vector<std::string> different(const std::vector<std::string>& words) {
  std::vector<std::string> result;
  for (const std::string& word : words)
    if (std::find(result.begin(), result.end(), word) == result.end()) result.push_back(word);
  return result;
}

Json camera_of(const std::vector<NamedPath>& paths) {
  std::array<double, 3> extent;
  for (std::size_t i = 0; i < 3; ++i) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const NamedPath& p : paths)
      for (const double v : i == 0 ? p.path->x : i == 1 ? p.path->y : p.path->z)
        if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
    extent[i] = high - low;
  }
  return plot::camera(extent);
}

HtmlFigure figure_in_space(const RunRecord& run) {
  Json traces = Json::array();
  for (const NamedPath& p : paths_of(run)) {
    Json trace = plot::line(p.name, p.path->x, p.path->y, p.colour, 4);
    trace["type"] = "scatter3d";
    trace["z"] = plot::numbers(p.path->z);
    trace["line"]["dash"] = p.dash;
    traces.push_back(std::move(trace));
  }
  Json layout = plot::layout("", "");
  layout.erase("xaxis");
  layout.erase("yaxis");
  layout["margin"] = {{"l", 0}, {"r", 0}, {"t", 0}, {"b", 0}};
  const auto axis = [](const char* name) { return Json{{"title", {{"text", fmt::format("{} [m]", name)}}}}; };
  layout["scene"] = {{"xaxis", axis("x")},
                     {"yaxis", axis("y")},
                     {"zaxis", axis("z")},
                     {"aspectmode", "data"},
                     {"camera", camera_of(paths_of(run))}};
  return {"Trajectories in space", "Drag to rotate, scroll or pinch to zoom.", traces, layout, 520};
}

HtmlFigure figure_from_above(const RunRecord& run) {
  Json traces = Json::array();
  for (const NamedPath& p : paths_of(run)) {
    Json trace = plot::line(p.name, p.path->x, p.path->y, p.colour);
    trace["line"]["dash"] = p.dash;
    traces.push_back(std::move(trace));
  }
  const std::vector<std::string> sensors = different(run.fix_sensors);
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    std::vector<double> x, y;
    for (std::size_t i = 0; i < run.fix_sensors.size(); ++i)
      if (run.fix_sensors[i] == sensors[s]) {
        x.push_back(run.fixes.x[i]);
        y.push_back(run.fixes.y[i]);
      }
    Json trace = plot::line(html_escaped(sensors[s]), x, y, plot::kGrey);
    trace["mode"] = "markers";
    trace["marker"] = {{"size", 4}, {"color", s == 0 ? plot::kGrey : plot::colour(1 + s)}, {"opacity", 0.6}};
    traces.push_back(std::move(trace));
  }
  Json layout = plot::layout("x [m]", "y [m]");
  layout["yaxis"]["scaleanchor"] = "x";
  return {"From above",
          run.has_target() && !run.fix_sensors.empty()
              ? "Measurements show the measured target position relative to the estimated chaser."
              : "",
          traces, layout, 520};
}

/// Returns the types of the run's keyframes with measurements, in the order of tables.
std::vector<std::string> measured_types(const RunRecord& run) {
  std::vector<std::string> types;
  for (const char* type : {"position", "pose", "partial"})
    if (std::find(run.types.begin(), run.types.end(), type) != run.types.end()) types.emplace_back(type);
  return types;
}

/// Adds strips at the bottom of a figure with the times of the keyframes of each type.
void add_strips(const RunRecord& run, const std::vector<std::string>& types, Json& traces, const std::string& axis) {
  for (std::size_t row = 0; row < types.size(); ++row) {
    std::vector<double> t, y;
    for (std::size_t i = 0; i < run.types.size(); ++i)
      if (run.types[i] == types[row]) {
        t.push_back(run.t[i]);
        y.push_back(double(row));
      }
    Json trace = plot::line("", t, y, plot::kGrey);
    trace["mode"] = "markers";
    trace["marker"] = {{"symbol", "line-ns-open"}, {"size", 9}, {"color", plot::colour(row == 0 ? 0 : 1 + row)}};
    trace["yaxis"] = axis;
    trace["hoverinfo"] = "x";
    traces.push_back(std::move(trace));
  }
}

/// Returns the 99 % quantile of the absolute errors plus a margin of 10 %.
double error_limit(std::vector<double> errors) {
  std::erase_if(errors, [](double e) { return !std::isfinite(e); });
  if (errors.empty()) return 0;
  for (double& e : errors) e = std::abs(e);
  return 1.1 * detail::quantile(std::move(errors), 0.99);
}

HtmlFigure figure_of_errors(const RunRecord& run) {
  constexpr double kBeyond = 1e7;  // m
  Json traces = Json::array();
  Json layout = plot::layout("t [s]", "");
  layout.erase("yaxis");
  const std::vector<std::string> types = measured_types(run);
  const bool strips = !types.empty();
  const double foot = strips ? 0.1 : 0.0, height = (1 - foot) / 3;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string axis = i == 0 ? "y" : fmt::format("y{}", i + 1);
    std::vector<double> low, high = run.three_sigma[i], sigmas;
    for (const double v : high)
      if (std::isfinite(v)) sigmas.push_back(v);
    for (double& v : high)  // unobservable; JSON has no infinity
      if (std::isinf(v)) v = kBeyond;
    for (const double v : high) low.push_back(-v);
    plot::add_band(traces, run.t, low, high, plot::translucent(5), axis);
    Json trace = plot::line("", run.t, run.error[i], plot::colour(0), 1);
    trace["yaxis"] = axis;
    traces.push_back(std::move(trace));
    Json y = plot::layout("", fmt::format("{} [m]", "xyz"[i]))["yaxis"];
    y["domain"] = {foot + double(2 - i) * height + 0.02, foot + double(3 - i) * height};
    if (!sigmas.empty()) {  // ignore the few huge bounds before the first measurements
      const double most = std::max(1.5 * detail::quantile(sigmas, 0.95), error_limit(run.error[i]));
      y["range"] = {-most, most};
    }
    layout[i == 0 ? "yaxis" : fmt::format("yaxis{}", i + 1)] = std::move(y);
  }
  layout["xaxis"]["anchor"] = strips ? "y4" : "y3";
  if (strips) {
    add_strips(run, types, traces, "y4");
    Json rows = Json::array();
    for (std::size_t row = 0; row < types.size(); ++row) rows.push_back(row);
    layout["yaxis4"] = {{"domain", {0, foot - 0.02}},  {"range", {-0.7, double(types.size()) - 0.3}},
                        {"tickvals", std::move(rows)}, {"ticktext", types},
                        {"showgrid", false},           {"zeroline", false},
                        {"automargin", true}};
  }
  if (!run.has_target())
    return {"Errors of the position over time",
            "Estimate minus truth along the world's axes, with ±3 σ bounds (shaded).", traces, layout, 600};
  return {"Errors of the relative position over time",
          "Estimate minus truth along the chaser's axes, with ±3 σ bounds (shaded). The strips at the bottom show the "
          "times of the keyframes with a measured position, a measured pose, or a partial measurement.",
          traces, layout, 640};
}

HtmlFigure figure_of_innovations(const RunRecord& run) {
  Json traces = Json::array();
  for (std::size_t i = 0; i < run.innovations.size(); ++i) {
    const RunRecord::Innovations& of = run.innovations[i];
    Json trace = plot::line(html_escaped(of.sensor), of.t, of.sigmas, plot::colour(i));
    trace["mode"] = "markers";
    trace["marker"] = {{"size", 4}, {"color", plot::colour(i)}};
    traces.push_back(std::move(trace));
  }
  return {"Innovations", "Innovation of each measurement in standard deviations, which the gate tests.", traces,
          plot::layout("t [s]", "σ"), 320};
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

bool any_finite(const std::vector<double>& values) {
  return std::any_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

}  // namespace

std::vector<HtmlFigure> run_figures(const RunRecord& run) {
  std::vector<HtmlFigure> figures = {figure_in_space(run), figure_from_above(run)};
  if (any_finite(run.error[0])) figures.push_back(figure_of_errors(run));
  if (any_finite(run.position_error) && !run.types.empty()) figures.push_back(figure_of_distribution(run));
  if (!run.innovations.empty()) figures.push_back(figure_of_innovations(run));
  return figures;
}

}  // namespace tandem
