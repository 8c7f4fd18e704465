#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/studies/report/plot_parts.hpp>
#include <tandem/studies/report/study_figures.hpp>
#include <tandem/studies/support/html_text.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

using plot::Json;

struct FigureMetric {
  const char *metric, *title, *what, *unit;
};
constexpr FigureMetric kFigureMetrics[] = {
    {"at_position_error_m", "Errors at keyframes with a measured position", "mean error", "m"},
    {"at_pose_error_m", "Errors at keyframes with a measured pose", "mean error", "m"},
    {"at_partial_error_m", "Errors at keyframes with a partial measurement", "mean error", "m"},
    {"at_none_error_m", "Errors at keyframes without a measurement", "mean error", "m"},
    {"gap_position_m", "Errors within gaps", "mean error", "m"},
    {"after_gap_position_m", "Errors in the 10 s after gaps", "mean error", "m"},
    {"chaser_position_m", "Errors of the chaser's position", "mean error", "m"},
    {"chaser_outage_position_m", "Errors during DVL outages", "mean error", "m"},
    {"chaser_orientation_deg", "Errors of the chaser's orientation", "mean error", "°"},
    {"dock_s", "Time until docked", "time", "s"},
    {"dock_miss_m", "Least distance from the dock", "distance", "m"}};

std::string parameter_text(const Study& study, const std::string& parameter) {
  const std::string& unit = study.parameter(parameter).unit;
  return parameter + (unit.empty() ? "" : fmt::format(" [{}]", unit));
}

/// Returns the index of a group's series: its model and solver, drawn in one colour.
std::size_t series_of(const Study& study, const StudyGroup& group) {
  return group.model * study.solvers.size() + group.solver;
}
std::size_t series_count(const Study& study) { return study.models.size() * study.solvers.size(); }

std::string series_name(const Study& study, std::size_t series) {
  const std::string& model = study.models[series / study.solvers.size()];
  return study.solvers.size() > 1 ? fmt::format("{}, {}", model, study.solvers[series % study.solvers.size()]) : model;
}

std::vector<double> values_of_group(const StudyGroup& group, std::string_view metric,
                                    std::vector<std::string>* labels = nullptr) {
  std::vector<double> values;
  for (const TrialResult* result : group.results)
    if (result)
      if (const auto value = result->get(metric)) {
        values.push_back(*value);
        if (labels) labels->push_back(fmt::format("trial {}", result->trial));
      }
  return values;
}

bool has_metric(const StudyTables& tables, std::string_view metric) {
  return std::any_of(tables.means.begin(), tables.means.end(),
                     [&](const StudyMean& mean) { return mean.metric == metric; });
}

/// Returns the varied parameters with their units.
std::string varied_text(const Study& study) {
  std::vector<std::string> names;
  for (const StudyAxis& axis : study.axes)
    if (axis.values.size() > 1) names.push_back(parameter_text(study, axis.parameter));
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Labels the x axis with the cells of the grid, at unit distances.
void label_cells(const StudyTables& tables, Json& layout) {
  Json at = Json::array(), text = Json::array();
  for (const StudyGroup& group : tables.groups)
    if (group.model == 0 && group.solver == 0) {
      at.push_back(group.cell);
      text.push_back(group.cell_text);
    }
  layout["xaxis"]["tickvals"] = std::move(at);
  layout["xaxis"]["ticktext"] = std::move(text);
  layout["xaxis"]["range"] = {-0.6, double(tables.groups.back().cell) + 0.6};
}

HtmlFigure figure_of_boxes(const Study& study, const StudyTables& tables, const FigureMetric& metric) {
  Json traces = Json::array();
  const auto count = double(series_count(study));
  for (std::size_t series = 0; series < series_count(study); ++series) {
    plot::Boxes boxes{
        series_name(study, series), plot::colour(series), plot::translucent(series), 0.7 / count, {}, {}, {}};
    for (const StudyGroup& group : tables.groups) {
      if (series_of(study, group) != series) continue;
      boxes.x.push_back(double(group.cell) + 0.8 * ((double(series) + 0.5) / count - 0.5));
      boxes.values.push_back(values_of_group(group, metric.metric, &boxes.labels.emplace_back()));
    }
    plot::add_boxes(traces, boxes);
  }
  Json layout = plot::layout(varied_text(study), fmt::format("{} of a trial [{}]", metric.what, metric.unit));
  label_cells(tables, layout);
  layout["yaxis"]["rangemode"] = "tozero";
  return {metric.title,
          "Quartiles and median over seeds. Whiskers reach to 1.5 times the box height; hover over a point beyond them "
          "to see its trial.",
          traces, layout, 440};
}

/// Returns the axis with three or more numeric values, if there is exactly one.
std::optional<std::size_t> numeric_axis(const Study& study) {
  std::optional<std::size_t> found;
  for (std::size_t a = 0; a < study.axes.size(); ++a) {
    if (study.axes[a].values.size() < 3) continue;
    const auto& values = study.axes[a].values;
    if (!std::all_of(values.begin(), values.end(), [](const auto& v) { return parse_number(v).has_value(); })) continue;
    if (found) return {};
    found = a;
  }
  return found;
}

HtmlFigure figure_along_axis(const Study& study, const StudyTables& tables, std::size_t axis,
                             const FigureMetric& metric) {
  std::size_t inner = 1;  // cells of one value of the axis that follow each other
  for (std::size_t a = axis + 1; a < study.axes.size(); ++a) inner *= study.axes[a].values.size();
  const auto& values = study.axes[axis].values;
  Json traces = Json::array();
  std::size_t line = 0;
  for (std::size_t series = 0; series < series_count(study); ++series)
    for (std::size_t rest = 0; rest < study.cells() / values.size(); ++rest) {
      std::vector<double> x, y, half;
      std::string name = series_name(study, series);
      for (const StudyMean& mean : tables.means) {
        const StudyGroup& group = *mean.group;
        const std::size_t value = group.cell / inner % values.size();
        const std::size_t others = group.cell / (inner * values.size()) * inner + group.cell % inner;
        if (mean.metric != metric.metric || series_of(study, group) != series || others != rest) continue;
        x.push_back(parse_number(values[value]).value());
        y.push_back(mean.mean.value);
        half.push_back(mean.mean.high - mean.mean.value);
        if (study.cells() > values.size()) name = fmt::format("{} ({})", series_name(study, series), group.cell_text);
      }
      if (x.empty()) continue;
      Json trace = plot::line(name, x, y, plot::colour(line++));
      trace["mode"] = "lines+markers";
      trace["error_y"] = {{"type", "data"}, {"array", plot::numbers(half)}};
      traces.push_back(std::move(trace));
    }
  Json layout =
      plot::layout(parameter_text(study, study.axes[axis].parameter), fmt::format("{} [{}]", metric.what, metric.unit));
  layout["yaxis"]["rangemode"] = "tozero";
  return {fmt::format("{} against {}", metric.title, study.axes[axis].parameter),
          "Means over seeds with 95 % confidence intervals.", traces, layout, 400};
}

/// Number of cells that a figure distinguishes by `kDashes` or `kSymbols`; beyond, only the hover text names the cell.
constexpr std::size_t kMarkedCells = 5;
constexpr const char* kDashes[kMarkedCells] = {"solid", "dash", "dot", "dashdot", "longdash"};
constexpr const char* kSymbols[kMarkedCells] = {"diamond", "square", "triangle-up", "triangle-down", "cross"};

std::string group_name(const Study& study, const StudyGroup& group) {
  const std::string name = series_name(study, series_of(study, group));
  return group.cell_text.empty() ? name : fmt::format("{} ({})", name, group.cell_text);
}

/// Adds a legend with an entry for each series, by colour, and each cell, by dash or symbol. Groups have no own entries:
/// there may be hundreds.
void add_legend(const Study& study, const StudyTables& tables, bool lines, Json& traces) {
  const auto add = [&](const std::string& name, const std::string& colour, std::size_t mark) {
    Json entry = plot::line(name, {}, {}, colour);
    entry["x"] = entry["y"] = Json::array({nullptr});
    if (lines) entry["line"]["dash"] = kDashes[mark];
    if (!lines) entry["mode"] = "markers";
    if (!lines) entry["marker"] = {{"size", 9}, {"color", colour}, {"symbol", kSymbols[mark]}};
    traces.push_back(std::move(entry));
  };
  for (std::size_t series = 0; series < series_count(study); ++series)
    add(series_name(study, series), plot::colour(series), 0);
  if (study.cells() == 1 || study.cells() > kMarkedCells) return;
  for (const StudyGroup& group : tables.groups)
    if (group.model == 0 && group.solver == 0) add(group.cell_text, plot::kGrey, group.cell);
}

HtmlFigure figure_of_distribution(const Study& study, const StudyTables& tables) {
  Json traces = Json::array();
  for (const StudyGroup& group : tables.groups) {
    const std::size_t series = series_of(study, group);
    const std::vector<double> values = values_of_group(group, rank_metric(study));
    if (values.empty()) continue;
    Json trace = plot::cumulative(group_name(study, group), values, plot::colour(series));
    trace["line"]["dash"] = kDashes[group.cell % kMarkedCells];
    trace["showlegend"] = false;
    traces.push_back(std::move(trace));
  }
  add_legend(study, tables, true, traces);
  Json layout = plot::layout(
      study.settings(study.place(0)).rendezvous ? "least distance from the dock [m]" : "mean error of a trial [m]",
      "share of trials");
  layout["xaxis"]["type"] = "log";
  return {"Distribution over trials", "Cumulative share of trials. Hover over a line to see its cell.", traces, layout,
          400};
}

/// Returns the consistency metrics of the study with their display names.
std::vector<std::pair<std::string, std::string>> quantities_in(const StudyTables& tables) {
  std::vector<std::pair<std::string, std::string>> names = {{"nees_chaser", "chaser"},
                                                            {"nees_velocity", "velocity"},
                                                            {"nees_bias", "IMU biases"},
                                                            {"nees_target", "target"},
                                                            {"nees_relative_pose", "relative pose"},
                                                            {"nees_relative_position", "relative position"}};
  for (const std::string& sensor : all_trial_sensors()) names.emplace_back(nis_metric(sensor), sensor + " (NIS)");
  std::vector<std::pair<std::string, std::string>> present;
  for (const auto& [metric, name] : names)
    if (std::any_of(tables.consistency.begin(), tables.consistency.end(),
                    [&, metric = metric](const StudyConsistency& row) { return row.metric == metric; }))
      present.emplace_back(metric, name);
  return present;
}

/// Returns a figure of NEES and NIS divided by their degrees of freedom.
HtmlFigure figure_of_consistency(const Study& study, const StudyTables& tables) {
  const std::vector<std::pair<std::string, std::string>> quantities = quantities_in(tables);
  Json traces = Json::array();
  Json layout = plot::layout("", "NEES or NIS / degrees of freedom");
  Json shapes = Json::array(), at = Json::array(), text = Json::array();
  const auto count = double(tables.groups.size());
  for (std::size_t g = 0; g < tables.groups.size(); ++g) {
    const StudyGroup& group = tables.groups[g];
    const std::string name = group_name(study, group), colour = plot::colour(series_of(study, group));
    std::vector<double> x, y, mean_x, mean_y, half;
    Json labels = Json::array();
    for (const StudyConsistency& row : tables.consistency) {
      if (row.group != &group) continue;
      const auto q = std::find_if(quantities.begin(), quantities.end(),
                                  [&](const auto& entry) { return row.metric == entry.first; });
      const double where = double(q - quantities.begin()) + 0.8 * ((double(g) + 0.5) / count - 0.5);
      const double width = 0.3 / count;
      shapes.push_back({{"type", "rect"},
                        {"layer", "below"},
                        {"line", {{"width", 0}}},
                        {"fillcolor", "#e3e8ee"},
                        {"x0", where - width},
                        {"x1", where + width},
                        {"y0", plot::number(row.low / row.degrees)},
                        {"y1", plot::number(row.high / row.degrees)}});
      mean_x.push_back(where);
      mean_y.push_back(row.mean.value / row.degrees);
      half.push_back((row.mean.high - row.mean.value) / row.degrees);
      std::vector<std::string> trials;
      for (const double value : values_of_group(group, row.metric, &trials)) {
        x.push_back(where);
        y.push_back(value / row.degrees);
      }
      for (const std::string& trial : trials) labels.push_back(trial);
    }
    if (mean_x.empty()) continue;
    Json dots = plot::line("", x, y, colour);
    dots["mode"] = "markers";
    dots["marker"] = {{"size", 3}, {"color", colour}, {"opacity", 0.35}};
    dots["text"] = std::move(labels);
    dots["hovertemplate"] = html_escaped(name) + ", %{text}: %{y}<extra></extra>";
    traces.push_back(std::move(dots));
    Json means = plot::line(name, mean_x, mean_y, colour);
    means["mode"] = "markers";
    means["showlegend"] = false;
    means["marker"] = {{"size", 9}, {"color", colour}, {"symbol", kSymbols[group.cell % kMarkedCells]}};
    means["error_y"] = {{"type", "data"}, {"array", plot::numbers(half)}};
    traces.push_back(std::move(means));
  }
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    at.push_back(q);
    text.push_back(quantities[q].second);
  }
  shapes.push_back({{"type", "line"},
                    {"x0", -0.6},
                    {"x1", double(quantities.size()) - 0.4},
                    {"y0", 1},
                    {"y1", 1},
                    {"line", {{"dash", "dot"}, {"width", 1}, {"color", plot::kGrey}}}});
  layout["shapes"] = std::move(shapes);
  layout["xaxis"]["tickvals"] = std::move(at);
  layout["xaxis"]["ticktext"] = std::move(text);
  layout["yaxis"]["type"] = "log";
  add_legend(study, tables, false, traces);
  return {"Consistency",
          "NEES and NIS divided by their degrees of freedom; a consistent estimator has 1. Dots are trials, large "
          "symbols their means with 95 % confidence intervals. Grey: 95 % band of the mean of a consistent estimator "
          "(χ²), with "
          "each trial as one sample. Above the band, σ is too small (optimistic); below, too large (pessimistic).",
          traces, layout, 460};
}

}  // namespace

std::vector<HtmlFigure> study_figures(const Study& study, const StudyTables& tables) {
  std::vector<HtmlFigure> figures;
  const auto axis = numeric_axis(study);
  for (const FigureMetric& metric : kFigureMetrics) {
    if (!has_metric(tables, metric.metric)) continue;
    if (axis) figures.push_back(figure_along_axis(study, tables, *axis, metric));
    figures.push_back(figure_of_boxes(study, tables, metric));
  }
  if (has_metric(tables, rank_metric(study))) figures.push_back(figure_of_distribution(study, tables));
  if (!tables.consistency.empty()) figures.push_back(figure_of_consistency(study, tables));
  return figures;
}

}  // namespace tandem
