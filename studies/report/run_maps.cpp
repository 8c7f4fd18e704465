#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/report/plot_parts.hpp>
#include <tandem/studies/report/run_maps.hpp>
#include <tandem/studies/report/time_panels.hpp>

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

/// The positions of a path along the axes of a plot: to the right and up on a map, and the third axis.
struct MapAxes {
  const std::vector<double>&right, &up, &third;
};
MapAxes on_map(const RunRecord& run, const RunRecord::Path& path) {
  return run.is_ned ? MapAxes{path.y, path.x, path.z} : MapAxes{path.x, path.y, path.z};
}
std::array<const char*, 3> map_titles(const RunRecord& run) {
  if (run.is_ned) return {"y (east) [m]", "x (north) [m]", "z (down) [m]"};
  return {"x [m]", "y [m]", "z [m]"};
}

/// The least and the largest coordinate of the paths along each axis of the map.
struct Extent {
  std::array<double, 3> low, high;

  double size(std::size_t i) const { return high[i] - low[i]; }
};

Extent extent(const RunRecord& run) {
  Extent all;
  all.low.fill(HUGE_VAL);
  all.high.fill(-HUGE_VAL);
  for (const NamedPath& p : paths_of(run)) {
    const MapAxes axes = on_map(run, *p.path);
    std::size_t i = 0;
    for (const auto* values : {&axes.right, &axes.up, &axes.third}) {
      for (const double v : *values)
        if (std::isfinite(v)) all.low[i] = std::min(all.low[i], v), all.high[i] = std::max(all.high[i], v);
      ++i;
    }
  }
  for (std::size_t i = 0; i < 3; ++i)
    if (!(all.low[i] <= all.high[i])) all.low[i] = all.high[i] = 0;  // a path without finite points
  return all;
}

}  // namespace

HtmlFigure figure_in_space(const RunRecord& run) {
  Json traces = Json::array();
  for (const NamedPath& p : paths_of(run)) {
    const MapAxes axes = on_map(run, *p.path);
    Json trace = plot::line(p.name, axes.right, axes.up, p.colour, 4);
    trace["type"] = "scatter3d";
    trace["z"] = plot::numbers(axes.third);
    trace["line"]["dash"] = p.dash;
    traces.push_back(std::move(trace));
  }
  Json layout = plot::layout("", "");
  layout.erase("xaxis");
  layout.erase("yaxis");
  layout["margin"] = {{"l", 0}, {"r", 0}, {"t", 0}, {"b", 0}};
  // The box fills the frame: its sides are at least a quarter of the longest one. Horizontal scales are equal.
  const Extent all = extent(run);
  const double most = std::max({all.size(0), all.size(1), all.size(2), 1e-3}), least = 0.25 * most;
  const double vertical = std::max(1.0, least / std::max(all.size(2), 1e-9));
  std::array<double, 3> side, size;  // in m, and in the scene
  for (std::size_t i = 0; i < 3; ++i) {
    side[i] = i < 2 ? std::max(all.size(i), least) : all.size(i);
    size[i] = i < 2 ? side[i] : side[i] * vertical;
  }
  const double scale = 1.55 / std::hypot(size[0], size[1], size[2]);
  const auto titles = map_titles(run);
  const char* const names[] = {"x", "y", "z"};
  Json& scene = layout["scene"];
  for (std::size_t i = 0; i < 3; ++i) {
    const double middle = (all.low[i] + all.high[i]) / 2, half = 0.53 * side[i];
    const bool down = i == 2 && run.is_ned;
    scene[std::string(names[i]) + "axis"] = {
        {"title", {{"text", titles[i]}}},
        {"nticks", 6},
        {"range",
         {plot::number(down ? middle + half : middle - half), plot::number(down ? middle - half : middle + half)}}};
    scene["aspectratio"][names[i]] = plot::number(scale * size[i]);
  }
  scene["aspectmode"] = "manual";
  scene["camera"] = {{"eye", {{"x", 0.7}, {"y", -1.3}, {"z", 0.8}}}, {"center", {{"x", 0}, {"y", 0}, {"z", -0.12}}}};
  return {"Trajectories in space",
          "Drag to rotate, scroll or pinch to zoom." +
              (vertical > 1.05 ? fmt::format(" Vertical lengths are enlarged {:.3g} times.", vertical) : ""),
          traces,
          layout,
          520,
          0.8};
}

HtmlFigure figure_from_above(const RunRecord& run) {
  Json traces = Json::array();
  const std::vector<std::string> sensors = different(run.fix_sensors);
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    RunRecord::Path fixes;
    for (std::size_t i = 0; i < run.fix_sensors.size(); ++i)
      if (run.fix_sensors[i] == sensors[s]) fixes.x.push_back(run.fixes.x[i]), fixes.y.push_back(run.fixes.y[i]);
    const MapAxes axes = on_map(run, fixes);
    Json trace = plot::line(sensors[s] + " fix", axes.right, axes.up, plot::kGrey);
    trace["mode"] = "markers";
    trace["marker"] = {{"size", 4}, {"color", s == 0 ? plot::kGrey : plot::colour(1 + s)}, {"opacity", 0.6}};
    traces.push_back(std::move(trace));
  }
  for (const NamedPath& p : paths_of(run)) {
    const MapAxes axes = on_map(run, *p.path);
    Json trace = plot::line(p.name, axes.right, axes.up, p.colour, p.dash[0] == 's' ? 1.5 : 2.5);
    trace["line"]["dash"] = p.dash;
    traces.push_back(std::move(trace));
  }
  for (const auto& [name, symbol, last] :
       {std::tuple{"start", "circle-open", false}, std::tuple{"end", "square", true}}) {
    std::vector<double> right, up;
    for (const RunRecord::Path* path : {&run.chaser, &run.target}) {
      if (path->t.empty()) continue;
      const MapAxes axes = on_map(run, *path);
      right.push_back(last ? axes.right.back() : axes.right.front());
      up.push_back(last ? axes.up.back() : axes.up.front());
    }
    Json trace = plot::line(name, right, up, "#1c2733");
    trace["mode"] = "markers";
    trace["marker"] = {{"symbol", symbol}, {"size", 9}, {"color", "#1c2733"}};
    traces.push_back(std::move(trace));
  }
  const auto titles = map_titles(run);
  Json layout = plot::layout(titles[0], titles[1]);
  layout["yaxis"]["scaleanchor"] = "x";
  for (const char* axis : {"xaxis", "yaxis"}) layout[axis]["constrain"] = "domain";
  const Extent all = extent(run);
  const double tall = all.size(1) / std::max(all.size(0), 1e-3);
  return {"From above",
          run.has_target() && !run.fix_sensors.empty()
              ? "Fixes show the measured target position relative to the estimated chaser."
              : "",
          traces,
          layout,
          int(std::clamp(110 + 900 * tall, 320.0, 640.0)),
          tall};
}

HtmlFigure figure_of_height(const RunRecord& run, const plot::TimeAxis& time) {
  plot::TimePanels panels(time, {1}, 240);
  Json& axis = panels.panel(map_titles(run)[2]);
  if (run.is_ned) axis["autorange"] = "reversed";
  for (const NamedPath& p : paths_of(run)) {
    Json& trace = panels.line(p.name, p.path->t, p.path->z, p.colour);
    trace["line"]["dash"] = p.dash;
  }
  return panels.figure(run.is_ned ? "Depth over time" : "Height over time", "");
}

bool is_planar(const RunRecord& run) { return extent(run).size(2) < 1e-6; }

}  // namespace tandem
