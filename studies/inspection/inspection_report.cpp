#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/inspection/scenario_inspection.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

constexpr std::size_t kStripWidth = 60;

/// The range of the values of one column.
struct ColumnRange {
  std::string column;
  double least = HUGE_VAL, most = -HUGE_VAL;
};

std::vector<ColumnRange> ranges_of(const SensorSeries& s) {
  std::vector<ColumnRange> ranges;
  for (std::size_t c = 1; c < s.columns.size(); ++c) {
    ColumnRange range{s.columns[c]};
    for (std::size_t i = 0; i < s.rows; ++i) {
      range.least = std::min(range.least, s.at(i, c));
      range.most = std::max(range.most, s.at(i, c));
    }
    if (s.rows > 0) ranges.push_back(range);
  }
  return ranges;
}

std::string origin_text(const ScenarioInspection& s) {
  return s.origin.empty() ? ""
                          : fmt::format(", origin {:.7f}, {:.7f} deg, {:.1f} m", s.origin[0], s.origin[1], s.origin[2]);
}

std::string span_text(const ScenarioInspection& s) {
  return fmt::format("{} to {} ({:.1f} s)", time_text_of(s.first()), time_text_of(s.last()), s.last() - s.first());
}

}  // namespace

double rate_of(const SensorSeries& s) {
  if (s.rows < 2) return 0;
  const double span = s.t(s.rows - 1) - s.t(0);
  return span > 0 ? static_cast<double>(s.rows - 1) / span : 0;
}

std::string range_text(const SensorSeries& s) {
  std::string text;
  for (const ColumnRange& range : ranges_of(s))
    text += fmt::format("{}{} {:.4g} … {:.4g}", text.empty() ? "" : ", ", range.column, range.least, range.most);
  return text;
}

std::string summary_text(const ScenarioInspection& scenario) {
  return fmt::format("{}{}, {}", scenario.frame, origin_text(scenario), span_text(scenario));
}

std::string inspection_text(const ScenarioInspection& scenario) {
  using enum TextTable::Align;
  std::string text =
      fmt::format("{}: {}{}\n{}\n\n", scenario.name, scenario.frame, origin_text(scenario), span_text(scenario));
  TextTable table({{"sensor", left}, {"type", left}, {"rows"}, {"rate [Hz]"}, {"longest gap [s]"}, {"strip", left}});
  for (const SensorSeries& s : scenario.series) {
    const SeriesGaps gaps = gaps_of(s);
    table.row({s.name, s.type, fmt::format("{}", s.rows), fmt::format("{:.3g}", rate_of(s)),
               gaps.count > 0 ? fmt::format("{:.1f}", gaps.longest) : "–", strip(scenario, s, kStripWidth)});
  }
  text += table.str() + "\nranges\n";
  for (const SensorSeries& s : scenario.series) text += fmt::format("  {}: {}\n", s.name, range_text(s));
  text += "\nlooks wrong\n";
  for (const std::string& sentence : scenario.unreadable) text += fmt::format("  {}\n", sentence);
  for (const std::string& sentence : scenario.findings) text += fmt::format("  {}\n", sentence);
  if (scenario.unreadable.empty() && scenario.findings.empty()) text += "  nothing\n";
  return text;
}

namespace {

JsonFields<ScenarioInspection> inspection_fields() {
  using I = ScenarioInspection;
  using S = SensorSeries;
  const auto time = [](const S& s, bool last) {
    return s.rows > 0 ? std::optional(s.t(last ? s.rows - 1 : 0)) : std::nullopt;
  };
  return JsonFields<I>()
      .add("folder", "scenario folder", [](const I& i) { return i.folder.string(); })
      .add("name", "name of the scenario", [](const I& i) { return i.name; })
      .add("frame", "axes of the scenario", [](const I& i) { return i.frame; })
      .add("origin", "latitude, longitude [deg] and height [m] of the origin, if it is stated",
           [](const I& i) { return i.origin.empty() ? std::nullopt : std::optional(i.origin); })
      .add_list("sensors", "files with rows",
                JsonFields<S>()
                    .add("name", "name", [](const S& s) { return s.name; })
                    .add("type", "type of the sensor, odometry, truth_chaser or truth_target",
                         [](const S& s) { return s.type; })
                    .add("rows", "number of rows", [](const S& s) { return s.rows; })
                    .add("first", "time of the first row [s]", [time](const S& s) { return time(s, false); })
                    .add("last", "time of the last row [s]", [time](const S& s) { return time(s, true); })
                    .add("rate_hz", "mean rate [Hz]", [](const S& s) { return rate_of(s); })
                    .add("gaps", "number of gaps: intervals of at least 5 s and at least 10 times the median",
                         [](const S& s) { return gaps_of(s).count; })
                    .add("longest_gap", "longest gap [s]", [](const S& s) { return gaps_of(s).longest; })
                    .add_map("ranges", "COLUMN", "smallest and largest value of each column",
                             JsonFields<ColumnRange>()
                                 .add("min", "smallest value", [](const ColumnRange& r) { return r.least; })
                                 .add("max", "largest value", [](const ColumnRange& r) { return r.most; }),
                             [](const S& s) {
                               std::vector<std::pair<std::string, ColumnRange>> ranges;
                               for (const ColumnRange& r : ranges_of(s)) ranges.emplace_back(r.column, r);
                               return ranges;
                             }),
                [](const I& i) -> const std::vector<S>& { return i.series; })
      .add("unreadable", "files that cannot be read, with the reason", [](const I& i) { return i.unreadable; })
      .add("findings", "suspicious data, one sentence each", [](const I& i) { return i.findings; });
}

}  // namespace

std::string inspection_json(const ScenarioInspection& scenario) {
  return json_text(json_document("info", inspection_fields(), scenario));
}

FileDescription inspection_json_keys() { return describe_json("--json", "info", inspection_fields()); }

}  // namespace tandem
