#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/report/plot_parts.hpp>
#include <tandem/studies/report/plotly_library.hpp>
#include <tandem/studies/report/rendezvous_page.hpp>

namespace tandem {
namespace {

using plot::Json;

constexpr double kHalfLength = 0.8;  // m: half length of a drawn body
constexpr int kRingPoints = 24, kFrameMilliseconds = 100;

/// Points of a polyline in space; NaN separates strokes.
struct SpaceLine {
  std::vector<double> x, y, z;

  void add(const Vector<3>& p) {
    x.push_back(p.x());
    y.push_back(p.y());
    z.push_back(p.z());
  }
  void lift() { add(Vector<3>::Constant(std::nan(""))); }
  Json json() const { return {{"x", plot::numbers(x)}, {"y", plot::numbers(y)}, {"z", plot::numbers(z)}}; }
};

/// Returns a body: a line from tail to nose, with an upward fin at the tail.
SpaceLine body(const SE3& pose) {
  SpaceLine line;
  for (const Vector<3>& p : {Vector<3>(kHalfLength, 0.0, 0.0), Vector<3>(-kHalfLength, 0.0, 0.0),
                             Vector<3>(-kHalfLength, 0.0, 0.4 * kHalfLength)})
    line.add(pose.act(p));
  return line;
}

/// Returns three circles about the target in the world's planes; empty in phases without keep-out distance.
SpaceLine keep_out_rings(const RendezvousStep& step, double radius) {
  SpaceLine line;
  if (step.phase != RendezvousPhase::searching && step.phase != RendezvousPhase::approach) return line;
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i <= kRingPoints; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kRingPoints;
      Vector<3> p = step.target.translation();
      p[(axis + 1) % 3] += radius * std::cos(angle);
      p[(axis + 2) % 3] += radius * std::sin(angle);
      line.add(p);
    }
    line.lift();
  }
  return line;
}

/// Returns the size of the lines along x, y and z, each at least `least`, which leaves room for the drawn bodies.
std::array<double, 3> extent_of(const std::array<const SpaceLine*, 2>& lines, double least) {
  std::array<double, 3> extent;
  for (std::size_t i = 0; i < 3; ++i) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const SpaceLine* line : lines)
      for (const double v : i == 0 ? line->x : i == 1 ? line->y : line->z)
        low = std::min(low, v), high = std::max(high, v);
    extent[i] = std::max(high - low, least);
  }
  return extent;
}

Json trace_of(const SpaceLine& line, const std::string& name, const std::string& colour, double width) {
  Json trace = line.json();
  trace["type"] = "scatter3d";
  trace["mode"] = "lines";
  trace["name"] = name;
  trace["line"] = {{"color", colour}, {"width", width}};
  trace["hoverinfo"] = "skip";
  return trace;
}

std::string caption_of(const RendezvousStep& step) {
  return fmt::format("{:.0f} s, {}: {:.2f} m apart{}", step.t, name(step.phase), step.distance,
                     step.origin.empty() ? "" : "; plan " + step.origin);
}

/// Returns the data of one animation frame: traces 0 to 2.
Json moving(const RendezvousStep& step, double keep_out) {
  Json data = Json::array();
  for (const SpaceLine& line : {body(step.chaser), body(step.target), keep_out_rings(step, keep_out)})
    data.push_back(line.json());
  return data;
}

/// Adds buttons and a slider for the frames. The name of a frame is its step number.
void add_controls(const RendezvousRun& run, Json& layout) {
  const Json now = {
      {"mode", "immediate"}, {"frame", {{"duration", 0}, {"redraw", true}}}, {"transition", {{"duration", 0}}}};
  Json play = now;
  play["frame"]["duration"] = kFrameMilliseconds;
  play["fromcurrent"] = true;
  Json steps = Json::array();
  for (std::size_t k = 0; k < run.steps.size(); ++k)
    steps.push_back({{"label", fmt::format("{:.0f}", run.steps[k].t)},
                     {"method", "animate"},
                     {"args", {Json::array({std::to_string(k)}), now}}});
  layout["sliders"] = {{{"steps", steps},
                        {"x", 0.14},
                        {"len", 0.84},
                        {"y", 0},
                        {"pad", {{"t", 10}, {"b", 0}}},
                        {"currentvalue", {{"prefix", "t = "}, {"suffix", " s"}}}}};
  const auto button = [](const char* label, const Json& target, const Json& how) {
    return Json{{"label", label}, {"method", "animate"}, {"args", {target, how}}};
  };
  layout["updatemenus"] = {
      {{"type", "buttons"},
       {"direction", "left"},
       {"showactive", false},
       {"x", 0},
       {"y", 0},
       {"xanchor", "left"},
       {"yanchor", "top"},
       {"pad", {{"t", 30}}},
       {"buttons", {button("Play", nullptr, play), button("Pause", Json::array({nullptr}), now)}}}};
}

HtmlFigure figure_of_manoeuvre(const std::string& method, const RendezvousRun& run, double keep_out) {
  SpaceLine chaser, target;
  for (const RendezvousStep& step : run.steps) {
    chaser.add(step.chaser.translation());
    target.add(step.target.translation());
  }
  const RendezvousStep& first = run.steps.front();
  Json traces = {trace_of(body(first.chaser), "chaser", plot::colour(0), 9),
                 trace_of(body(first.target), "target", plot::colour(1), 9),
                 trace_of(keep_out_rings(first, keep_out), "keep-out distance", plot::kGrey, 2),
                 trace_of(chaser, "chaser's path", plot::colour(0), 2),
                 trace_of(target, "target's path", plot::colour(1), 2)};
  Json frames = Json::array();
  for (std::size_t k = 0; k < run.steps.size(); ++k)
    frames.push_back({{"name", std::to_string(k)},
                      {"data", moving(run.steps[k], keep_out)},
                      {"traces", {0, 1, 2}},
                      {"layout", {{"title", {{"text", caption_of(run.steps[k])}}}}}});
  Json layout = plot::layout("", "");
  layout.erase("xaxis");
  layout.erase("yaxis");
  layout["title"] = {
      {"text", caption_of(first)}, {"font", {{"size", 14}}}, {"x", 0.02}, {"y", 0.98}, {"yanchor", "top"}};
  layout["margin"] = {{"l", 0}, {"r", 0}, {"t", 30}, {"b", 90}};
  const auto axis = [](const char* name) { return Json{{"title", {{"text", fmt::format("{} [m]", name)}}}}; };
  layout["scene"] = {{"xaxis", axis("x")},
                     {"yaxis", axis("y")},
                     {"zaxis", axis("z")},
                     {"aspectmode", "data"},
                     {"camera", plot::camera(extent_of({&chaser, &target}, 2.0 * std::max(keep_out, kHalfLength)))}};
  layout["legend"] = {{"x", 1}, {"xanchor", "right"}, {"y", 1}};
  add_controls(run, layout);
  HtmlFigure figure(
      "Manoeuvre, " + method,
      "True motion at ten times real speed: press Play or move the slider. Bodies are lines of 1.6 m with an "
      "upward fin at the stern. Circles show the keep-out distance while it applies.",
      traces, layout, 640);
  figure.set_frames(frames);
  return figure;
}

HtmlFigure figure_of_distances(const std::string& method, const RendezvousRun& run) {
  std::vector<double> t, distance, sigma, t_known, error, ms;
  for (const RendezvousStep& step : run.steps) {
    t.push_back(step.t);
    distance.push_back(step.distance);
    ms.push_back(step.origin.empty() ? std::nan("") : 1e3 * step.solve_seconds);
    if (step.three_sigma.isZero(0)) continue;
    t_known.push_back(step.t);
    sigma.push_back(step.three_sigma.norm());
    error.push_back((step.estimated.translation() - step.relative.translation()).norm());
  }
  Json traces = Json::array();
  traces.push_back(plot::line("distance between chaser and target [m]", t, distance, plot::colour(0)));
  traces.push_back(plot::line("error of the estimated relative position [m]", t_known, error, plot::colour(1)));
  traces.push_back(plot::line("3 σ of the estimated relative position [m]", t_known, sigma, plot::colour(4)));
  traces.push_back(plot::line("solve time of the plan [ms]", t, ms, plot::kGrey, 1));
  Json layout = plot::layout("t [s]", "m, ms");
  layout["yaxis"]["type"] = "log";
  return {"Over time, " + method, "Distance, estimation error with 3 σ, and solve time.", traces, layout, 420};
}

}  // namespace

std::string rendezvous_page(const RendezvousStudy& study) {
  HtmlPage page(fmt::format("Rendezvous of a {}", study.vehicle));
  page.paragraph(fmt::format(
      "Simulation: planning horizon {:g} s, keep-out distance {:g} m before docking, target speed {:g} m/s.",
      study.options.horizon, study.options.keep_out, study.options.target_speed));
  page.heading("Runs");
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < study.runs.size(); ++i)
    for (const RendezvousRun& run : study.runs[i])
      rows.push_back({std::string(name(study.methods[i])), std::to_string(run.seed), std::string(name(run.outcome)),
                      fmt::format("{:.1f}", run.seconds), fmt::format("{:.2f}", run.least_miss),
                      fmt::format("{:.2f}", run.keep_out_violation), fmt::format("{}", run.plans),
                      fmt::format("{}", run.shifted)});
  page.folded_table(
      "Outcome of each run. Shifted plans are fallbacks: the previous plan, shifted by a step.",
      {"method", "seed", "outcome", "duration [s]", "least miss [m]", "inside keep-out [m]", "plans", "shifted"}, rows);
  for (std::size_t i = 0; i < study.runs.size(); ++i) {
    if (study.runs[i].empty() || study.runs[i].front().steps.empty()) continue;
    const RendezvousRun& run = study.runs[i].front();
    const std::string method = fmt::format("{}, seed {}", name(study.methods[i]), run.seed);
    page.heading(fmt::format("{}: {} after {:.1f} s", method, name(run.outcome), run.seconds));
    page.figure(figure_of_manoeuvre(method, run, study.options.keep_out));
    page.figure(figure_of_distances(method, run));
  }
  return page.text(plotly_library());
}

}  // namespace tandem
