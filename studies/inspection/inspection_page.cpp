#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/inspection/scenario_inspection.hpp>

namespace tandem {
namespace {

constexpr double kWidth = 900, kStripHeight = 22;  // px
constexpr std::size_t kMaxPoints = 3000;
constexpr const char* kColours[] = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e"};

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text)
    result += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : c == '"' ? "&quot;" : std::string(1, c);
  return result;
}

/// Returns one bar for each sensor over the time: an interval without rows is blank.
std::string strips(const ScenarioInspection& scenario) {
  const double first = scenario.first(), span = std::max(scenario.last() - first, 1e-9), left = 130;
  const double height = kStripHeight * static_cast<double>(scenario.series.size()) + 24;
  std::string svg = fmt::format("<svg viewBox='0 0 {} {}' role='img' aria-label='rows over time'>\n", kWidth, height);
  const auto x = [&](double t) { return left + (kWidth - left - 10) * (t - first) / span; };
  double y = 4;
  for (const SensorSeries& s : scenario.series) {
    svg += fmt::format("<text x='0' y='{:.0f}'>{}</text>\n", y + 14, escaped(s.name));
    const double longest = std::max(gaps_of(s).median_step * 5, span / 2000);
    for (std::size_t i = 0; i < s.rows;) {
      std::size_t end = i + 1;
      while (end < s.rows && s.t(end) - s.t(end - 1) <= longest) ++end;
      svg += fmt::format("<rect x='{:.1f}' y='{:.0f}' width='{:.1f}' height='14' fill='{}'/>\n", x(s.t(i)), y + 2,
                         std::max(1.0, x(s.t(end - 1)) - x(s.t(i))), kColours[0]);
      i = end;
    }
    y += kStripHeight;
  }
  svg += fmt::format(
      "<text x='{}' y='{:.0f}'>0 s</text><text x='{}' y='{:.0f}' text-anchor='end'>{:.0f} s after {}</text>\n", left,
      y + 14, kWidth - 10, y + 14, span, time_text_of(first));
  return svg + "</svg>\n";
}

bool has_positions(const SensorSeries& s) {
  return s.rows > 0 && (s.type == "odometry" || s.type == "gps" || s.type.starts_with("truth"));
}

/// Returns the positions in the world on a plan view: east to the right and north up.
std::string plan(const ScenarioInspection& scenario) {
  const std::size_t east = scenario.is_ned() ? 2 : 1, north = scenario.is_ned() ? 1 : 2;
  double least[2] = {HUGE_VAL, HUGE_VAL}, most[2] = {-HUGE_VAL, -HUGE_VAL};
  for (const SensorSeries& s : scenario.series)
    for (std::size_t i = 0; has_positions(s) && i < s.rows; ++i)
      for (const auto& [axis, column] : {std::pair{0, east}, {1, north}}) {
        least[axis] = std::min(least[axis], s.at(i, column));
        most[axis] = std::max(most[axis], s.at(i, column));
      }
  if (!(least[0] <= most[0])) return "";
  const double size = std::max({most[0] - least[0], most[1] - least[1], 1.0}), margin = 30;
  const double scale = (kWidth * 0.6 - 2 * margin) / size, height = (most[1] - least[1]) * scale + 2 * margin;
  std::string svg = fmt::format("<svg viewBox='0 0 {} {:.0f}' role='img' aria-label='plan view'>\n", kWidth, height);
  std::size_t n = 0;
  for (const SensorSeries& s : scenario.series) {
    if (!has_positions(s)) continue;
    const char* colour = kColours[n % std::size(kColours)];
    std::string points;
    for (std::size_t i = 0; i < s.rows; i += std::max<std::size_t>(1, s.rows / kMaxPoints))
      points += fmt::format("{:.1f},{:.1f} ", margin + (s.at(i, east) - least[0]) * scale,
                            margin + (most[1] - s.at(i, north)) * scale);
    svg += fmt::format("<polyline points='{}' fill='none' stroke='{}' stroke-width='1.5'/>\n", points, colour);
    svg += fmt::format("<text x='{}' y='{}' fill='{}'>{}</text>\n", kWidth * 0.7, 20 + 18 * n, colour, escaped(s.name));
    ++n;
  }
  return svg + fmt::format("<text x='{}' y='{:.0f}'>north up, {:.3g} m high, {:.3g} m wide</text></svg>\n", margin,
                           height - 6, most[1] - least[1], most[0] - least[0]);
}

}  // namespace

std::string inspection_page(const ScenarioInspection& scenario) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'><title>{0}</title>\n<style>body{{font:16px "
      "sans-serif;max-width:{1}px;margin:2em auto;padding:0 1em}}svg{{width:100%}}svg text{{font-size:13px}}"
      "pre{{overflow-x:auto}}</style></head><body>\n<h1>{0}</h1>\n",
      escaped(scenario.name), kWidth);
  page += "<h2>Looks wrong</h2>\n<ul>\n";
  for (const auto* sentences : {&scenario.unreadable, &scenario.findings})
    for (const std::string& sentence : *sentences) page += fmt::format("<li>{}</li>\n", escaped(sentence));
  if (scenario.unreadable.empty() && scenario.findings.empty()) page += "<li>nothing</li>\n";
  page += "</ul>\n<h2>Rows over time</h2>\n" + strips(scenario);
  if (const std::string view = plan(scenario); !view.empty()) page += "<h2>Plan view</h2>\n" + view;
  return page + "<h2>Sensors</h2>\n<pre>" + escaped(inspection_text(scenario)) + "</pre>\n</body></html>\n";
}

}  // namespace tandem
