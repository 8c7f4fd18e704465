#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include <tandem/problem/quantile.hpp>
#include <tandem/studies/report/plot_parts.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem::plot {
namespace {

constexpr std::array<std::array<int, 3>, 7> kColours = {
    {{0, 114, 178}, {213, 94, 0}, {0, 158, 115}, {204, 121, 167}, {230, 159, 0}, {86, 180, 233}, {100, 100, 100}}};

}  // namespace

Json number(double value) {
  if (!std::isfinite(value)) return nullptr;
  return parse_number(fmt::format("{:.5g}", value)).value_or(value);
}

Json numbers(const std::vector<double>& values) {
  Json array = Json::array();
  for (const double value : values) array.push_back(number(value));
  return array;
}

std::string colour(std::size_t i) {
  const auto& [r, g, b] = kColours[i % kColours.size()];
  return fmt::format("rgb({},{},{})", r, g, b);
}

std::string translucent(std::size_t i) {
  const auto& [r, g, b] = kColours[i % kColours.size()];
  return fmt::format("rgba({},{},{},0.25)", r, g, b);
}

Json layout(const std::string& x, const std::string& y) {
  const auto axis = [](const std::string& title) {
    return Json{{"title", {{"text", title}}}, {"zeroline", false}, {"gridcolor", "#e6ebf0"}, {"automargin", true}};
  };
  return {{"xaxis", axis(x)},
          {"yaxis", axis(y)},
          {"margin", {{"l", 60}, {"r", 15}, {"t", 10}, {"b", 50}}},
          {"font", {{"family", "system-ui, DejaVu Sans, sans-serif"}, {"size", 12}, {"color", "#1c2733"}}},
          {"legend", {{"orientation", "h"}, {"y", 1.02}, {"yanchor", "bottom"}, {"x", 0}}},
          {"hovermode", "closest"},
          {"plot_bgcolor", "#fff"},
          {"paper_bgcolor", "#fff"}};
}

Json camera(const std::array<double, 3>& extent) {
  double product = 1, squares = 0;  // plotly.js scales the scene to a volume of one
  for (const double side : extent) {
    const double e = std::max(side, 1e-3);  // also for a path without finite points
    product *= e;
    squares += e * e;
  }
  const double distance = 1.4 * std::sqrt(squares) / std::cbrt(product);
  return {{"eye", {{"x", 0.35 * distance}, {"y", -0.7 * distance}, {"z", 0.6 * distance}}}};
}

Json line(const std::string& name, const std::vector<double>& x, const std::vector<double>& y,
          const std::string& colour, double width) {
  return {{"type", "scatter"},
          {"mode", "lines"},
          {"name", name},
          {"showlegend", !name.empty()},
          {"x", numbers(x)},
          {"y", numbers(y)},
          {"line", {{"color", colour}, {"width", width}}}};
}

void add_band(Json& traces, const std::vector<double>& x, const std::vector<double>& low,
              const std::vector<double>& high, const std::string& colour, const std::string& y_axis) {
  for (const auto* const edge : {&low, &high}) {
    Json trace = line("", x, *edge, "rgba(0,0,0,0)", 0);
    trace["yaxis"] = y_axis;
    trace["hoverinfo"] = "skip";
    if (edge == &high) trace["fill"] = "tonexty";
    if (edge == &high) trace["fillcolor"] = colour;
    traces.push_back(std::move(trace));
  }
}

Json cumulative(const std::string& name, std::vector<double> values, const std::string& colour) {
  std::sort(values.begin(), values.end());
  std::vector<double> share(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) share[i] = double(i + 1) / double(values.size());
  Json trace = line(name, values, share, colour);
  trace["line"]["shape"] = "hv";
  return trace;
}

void add_boxes(Json& traces, const Boxes& boxes) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> box_x, box_y, line_x, line_y, point_x, point_y;
  Json labels = Json::array();
  for (std::size_t i = 0; i < boxes.values.size(); ++i) {
    std::vector<double> sorted = boxes.values[i];
    if (sorted.empty()) continue;
    std::sort(sorted.begin(), sorted.end());
    const double low = detail::quantile(sorted, 0.25), middle = detail::median(sorted),
                 high = detail::quantile(sorted, 0.75);
    const double reach = 1.5 * (high - low), x = boxes.x[i], l = x - boxes.width / 2, r = x + boxes.width / 2;
    const double bottom = *std::lower_bound(sorted.begin(), sorted.end(), low - reach);
    const double top = *(std::upper_bound(sorted.begin(), sorted.end(), high + reach) - 1);
    for (const auto& [px, py] : {std::pair{l, low}, {r, low}, {r, high}, {l, high}, {l, low}, {none, none}}) {
      box_x.push_back(px);
      box_y.push_back(py);
    }
    for (const auto& [px, py] : {std::pair{l, middle},
                                 {r, middle},
                                 {none, none},
                                 {x, low},
                                 {x, bottom},
                                 {none, none},
                                 {x, high},
                                 {x, top},
                                 {none, none}}) {
      line_x.push_back(px);
      line_y.push_back(py);
    }
    for (std::size_t k = 0; k < boxes.values[i].size(); ++k)
      if (const double y = boxes.values[i][k]; y < low - reach || y > high + reach) {
        point_x.push_back(x);
        point_y.push_back(y);
        labels.push_back(boxes.labels[i][k]);
      }
  }
  Json box = line(boxes.name, box_x, box_y, boxes.colour, 1);
  box["fill"] = "toself";
  box["fillcolor"] = boxes.translucent;
  box["legendgroup"] = boxes.name;
  box["hoverinfo"] = "skip";
  traces.push_back(std::move(box));
  Json lines = line("", line_x, line_y, boxes.colour, 2);
  lines["legendgroup"] = boxes.name;
  traces.push_back(std::move(lines));
  if (point_x.empty()) return;
  Json points = line("", point_x, point_y, boxes.colour);
  points["mode"] = "markers";
  points["marker"] = {{"color", boxes.colour}, {"size", 5}};
  points["text"] = std::move(labels);
  points["hovertemplate"] = "%{text}: %{y}<extra></extra>";
  points["legendgroup"] = boxes.name;
  traces.push_back(std::move(points));
}

}  // namespace tandem::plot
