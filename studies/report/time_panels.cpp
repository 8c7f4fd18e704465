#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include <tandem/studies/report/time_panels.hpp>

namespace tandem::plot {
namespace {

constexpr int kTop = 10, kBottom = 60;  // pixels

}  // namespace

TimePanels::TimePanels(const TimeAxis& time, std::vector<double> shares, int height)
    : time_(time), shares_(std::move(shares)), height_(height), layout_(layout("", "")) {
  layout_["xaxis"] = time_.axis();
  layout_.erase("yaxis");
  layout_["shapes"] = Json::array();
}

std::string TimePanels::axis_name() const { return panels_ == 1 ? "y" : fmt::format("y{}", panels_); }

Json& TimePanels::panel(const std::string& title) {
  const double all = std::accumulate(shares_.begin(), shares_.end(), 0.0);
  const double above = std::accumulate(shares_.begin(), shares_.begin() + std::ptrdiff_t(panels_), 0.0) / all;
  const double bottom = 1 - above - shares_[panels_] / all;
  ++panels_;
  Json& axis = layout_[panels_ == 1 ? "yaxis" : fmt::format("yaxis{}", panels_)];
  axis = layout("", title)["yaxis"];
  axis["domain"] = {number(panels_ == shares_.size() ? 0.0 : bottom + 12.0 / height_), number(1 - above)};
  layout_["xaxis"]["anchor"] = axis_name();
  return axis;
}

Json& TimePanels::add(const std::string& name, const std::vector<double>& t, Json trace) {
  trace["x"] = time_.values(t);
  trace["yaxis"] = axis_name();
  if (!name.empty()) trace["legendgroup"] = name;
  if (std::find(names_.begin(), names_.end(), name) != names_.end()) trace["showlegend"] = false;
  names_.push_back(name);
  traces_.push_back(std::move(trace));
  return traces_.back();
}

Json& TimePanels::line(const std::string& name, const std::vector<double>& t, const std::vector<double>& y,
                       const std::string& colour, double width) {
  return add(name, t, plot::line(name, {}, y, colour, width));
}

Json& TimePanels::points(const std::string& name, const std::vector<double>& t, const std::vector<double>& y,
                         const std::string& colour, double size, const std::string& symbol) {
  Json trace = plot::line(name, {}, y, colour);
  trace["mode"] = "markers";
  trace["marker"] = {{"size", size}, {"color", colour}, {"symbol", symbol}};
  return add(name, t, std::move(trace));
}

void TimePanels::band(const std::vector<double>& t, const std::vector<double>& half, const std::string& colour) {
  std::vector<double> at, edge;
  for (std::size_t i = 0; i < t.size();) {
    std::size_t end = i;
    while (end < t.size() && std::isfinite(half[end])) ++end;
    for (std::size_t k = i; k < end; ++k) at.push_back(t[k]), edge.push_back(half[k]);
    for (std::size_t k = end; k-- > i;) at.push_back(t[k]), edge.push_back(-half[k]);
    if (end > i) at.push_back(std::nan("")), edge.push_back(std::nan(""));
    i = end + 1;
  }
  Json& trace = line("", at, edge, "rgba(0,0,0,0)", 0);
  trace["fill"] = "toself";
  trace["fillcolor"] = colour;
  trace["hoverinfo"] = "skip";
}

Json& TimePanels::ticks(const std::string& name, const std::vector<double>& t, double row, const std::string& colour) {
  Json& trace = points(name, t, std::vector<double>(t.size(), row), colour, 9, "line-ns-open");
  trace["hoverinfo"] = "x";
  return trace;
}

void TimePanels::level(double y) {
  layout_["shapes"].push_back({{"type", "line"},
                               {"xref", "paper"},
                               {"x0", 0},
                               {"x1", 1},
                               {"yref", axis_name()},
                               {"y0", y},
                               {"y1", y},
                               {"layer", "below"},
                               {"line", {{"dash", "dot"}, {"width", 1}, {"color", kGrey}}}});
}

HtmlFigure TimePanels::figure(const std::string& title, const std::string& caption) const {
  return {title, caption, traces_, layout_, height_ + kTop + kBottom};
}

}  // namespace tandem::plot
