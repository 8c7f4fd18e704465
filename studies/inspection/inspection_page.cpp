#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/inspection/scenario_inspection.hpp>
#include <tandem/studies/support/html_text.hpp>

namespace tandem {
namespace {

constexpr double kWidth = 900, kStripHeight = 22;  // px
constexpr std::size_t kMaxPoints = 3000;
constexpr int kMaxTicks = 20;
/// Palette that suits all kinds of colour vision (Okabe & Ito 2008).
constexpr const char* kColours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"};
constexpr const char* kStyle = R"(
body { font: 16px/1.5 system-ui, "DejaVu Sans", sans-serif; color: #1c2733; max-width: 900px; margin: 0 auto;
       padding: 1rem; }
.wide { overflow-x: auto; }
svg { width: 100%; min-width: 640px; display: block; }
svg text { font-size: 13px; fill: #1c2733; }
table { border-collapse: collapse; font-size: .88rem; }
th, td { padding: .25em .7em; text-align: right; white-space: nowrap; border-bottom: 1px solid #e6ebf0; }
th:first-child, td:first-child, th:last-child, td:last-child { text-align: left; }
)";

/// Returns one bar for each sensor over the time: an interval without rows is blank.
std::string strips(const ScenarioInspection& scenario) {
  const double first = scenario.first(), span = std::max(scenario.last() - first, 1e-9), left = 130;
  const double height = kStripHeight * static_cast<double>(scenario.series.size()) + 24;
  std::string svg = fmt::format("<svg viewBox='0 0 {} {}' role='img' aria-label='rows over time'>\n", kWidth, height);
  const auto x = [&](double t) { return left + (kWidth - left - 10) * (t - first) / span; };
  double y = 4;
  for (const SensorSeries& s : scenario.series) {
    svg += fmt::format("<text x='0' y='{:.0f}'>{}</text>\n", y + 14, html_escaped(s.name));
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

/// Returns a distance of ticks for an axis: 1, 2 or 5 times a power of ten.
double tick_step(double span) {
  const double power = std::pow(10, std::floor(std::log10(span / 4)));
  return span / 4 < 2 * power ? power : span / 4 < 5 * power ? 2 * power : 5 * power;
}

/// Returns the multiples of `step` in a range.
std::vector<double> ticks(double least, double most, double step) {
  std::vector<double> all;
  const double first = std::ceil(least / step), last = std::floor(most / step);
  for (int i = 0; first + i <= last && i <= kMaxTicks; ++i) all.push_back((first + i) * step + 0.0);  // no −0
  return all;
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
  const double size = std::max({most[0] - least[0], most[1] - least[1], 1.0}), left = 80, below = 50, top = 10;
  const double scale = (kWidth * 0.7 - left) / size, bottom = (most[1] - least[1]) * scale + top;
  const double right = left + (most[0] - least[0]) * scale, height = bottom + below;
  const auto x = [&](double value) { return left + (value - least[0]) * scale; };
  const auto y = [&](double value) { return bottom - (value - least[1]) * scale; };
  std::string svg = fmt::format("<svg viewBox='0 0 {} {:.0f}' role='img' aria-label='plan view'>\n", kWidth, height);
  const double step = tick_step(size);
  for (const double v : ticks(least[0], most[0], step))
    svg += fmt::format(
        "<path d='M{0:.1f} {1:.0f}V{2:.0f}' stroke='#e6ebf0'/><text x='{0:.1f}' y='{3:.0f}' "
        "text-anchor='middle'>{4:g}</text>\n",
        x(v), top, bottom, bottom + 18, v);
  for (const double v : ticks(least[1], most[1], step))
    svg += fmt::format(
        "<path d='M{0:.0f} {1:.1f}H{2:.1f}' stroke='#e6ebf0'/><text x='{3:.0f}' y='{4:.1f}' "
        "text-anchor='end'>{5:g}</text>\n",
        left, y(v), right, left - 6, y(v) + 4, v);
  const char *const east_name = scenario.is_ned() ? "y (east) [m]" : "x [m]", *const north_name = scenario.is_ned()
                                                                                                      ? "x (north) [m]"
                                                                                                      : "y [m]";
  svg += fmt::format(
      "<text x='{:.0f}' y='{:.0f}' text-anchor='middle'>{}</text><text transform='translate(16 {:.0f}) "
      "rotate(-90)' text-anchor='middle'>{}</text>\n",
      (left + right) / 2, bottom + 40, east_name, (top + bottom) / 2, north_name);
  std::size_t n = 0;
  for (const SensorSeries& s : scenario.series) {
    if (!has_positions(s)) continue;
    const char* colour = kColours[n % std::size(kColours)];
    std::string points;
    for (std::size_t i = 0; i < s.rows; i += std::max<std::size_t>(1, s.rows / kMaxPoints))
      points += fmt::format("{:.1f},{:.1f} ", x(s.at(i, east)), y(s.at(i, north)));
    svg += fmt::format("<polyline points='{}' fill='none' stroke='{}' stroke-width='1.5'/>\n", points, colour);
    svg += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='5' fill='none' stroke='{}' stroke-width='2'/>\n",
                       x(s.at(0, east)), y(s.at(0, north)), colour);
    svg +=
        fmt::format("<path d='M{0:.0f} {1}h18' stroke='{2}' stroke-width='3'/><text x='{3:.0f}' y='{4}'>{5}</text>\n",
                    kWidth * 0.74, 16 + 20 * n, colour, kWidth * 0.74 + 26, 20 + 20 * n, html_escaped(s.name));
    ++n;
  }
  return svg +
         fmt::format("<text x='{:.0f}' y='{}'>north up; circle: first row</text></svg>\n", kWidth * 0.74, 24 + 20 * n);
}

std::string sensor_table(const ScenarioInspection& scenario) {
  std::string table =
      "<table><tr><th>sensor</th><th>type</th><th>rows</th><th>rate [Hz]</th><th>longest gap [s]</th><th>ranges (SI "
      "units, radians)</th></tr>\n";
  for (const SensorSeries& s : scenario.series) {
    const SeriesGaps gaps = gaps_of(s);
    table += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{:.3g}</td><td>{}</td><td>{}</td></tr>\n",
                         html_escaped(s.name), html_escaped(s.type), s.rows, rate_of(s),
                         gaps.count > 0 ? fmt::format("{:.1f}", gaps.longest) : "–", html_escaped(range_text(s)));
  }
  return table + "</table>\n";
}

}  // namespace

std::string inspection_page(const ScenarioInspection& scenario) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{0}</title>\n<style>{1}</style></head><body>\n<h1>{0}</h1>\n<p>{2}</p>\n",
      html_escaped(scenario.name), kStyle, html_escaped(summary_text(scenario)));
  page += "<h2>Looks wrong</h2>\n<ul>\n";
  for (const auto* sentences : {&scenario.unreadable, &scenario.findings})
    for (const std::string& sentence : *sentences) page += fmt::format("<li>{}</li>\n", html_escaped(sentence));
  if (scenario.unreadable.empty() && scenario.findings.empty()) page += "<li>nothing</li>\n";
  page += "</ul>\n<h2>Rows over time</h2>\n<div class=\"wide\">" + strips(scenario) + "</div>\n";
  if (const std::string view = plan(scenario); !view.empty())
    page += "<h2>Plan view</h2>\n<div class=\"wide\">" + view + "</div>\n";
  return page + "<h2>Sensors</h2>\n<div class=\"wide\">" + sensor_table(scenario) + "</div>\n</body></html>\n";
}

}  // namespace tandem
