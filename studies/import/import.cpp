#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/import/import.hpp>
#include <tandem/studies/import/import_assumptions.hpp>
#include <tandem/studies/inspection/sensor_series.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

using Sensors = std::vector<std::unique_ptr<ImportedSensor>>;

bool is_own_sensor(const ImportedSensor& s) {
  const std::string_view type = s.sensor().type->name;
  return type == "imu" || type == "dvl" || type == "depth" || type == "gps" || type == "heading";
}
bool is_truth(const ImportedSensor& s) { return s.sensor().type->name.starts_with("truth"); }
bool is_odometry(const ImportedSensor& s) { return s.sensor().type->name == "odometry"; }
bool is_of_target(const ImportedSensor& s) { return !is_own_sensor(s) && !is_truth(s) && !is_odometry(s); }

std::string listed_drops(const ImportedSensor& sensor) {
  std::vector<std::string> texts;
  for (const auto& [reason, dropped] : sensor.dropped())
    texts.push_back(fmt::format("{} × {} (first: {})", dropped.count, reason, dropped.example));
  return listed(texts);
}

/// Throws Error if a sensor has no rows.
void require_rows(const Import& import) {
  for (const auto& s : import.sensors)
    if (s->rows() == 0)
      throw Error(fmt::format("{}: no row of {} is usable ({} read; dropped: {}{})", s->sensor().name,
                              s->sensor().stream, s->read(), s->dropped().empty() ? "none" : listed_drops(*s),
                              import.defects.empty() ? "" : "; " + import.defects.front()));
}

/// Sets the origin of the local frame: that of the map, or the first fix of the chaser, or of any sensor.
void set_frame(Import& import) {
  std::optional<GeographicPoint> origin = import.map.origin;
  for (const bool own : {true, false})
    for (const auto& s : import.sensors)
      if (!origin && is_own_sensor(*s) == own)
        if (const auto fix = s->first_fix()) {
          origin = fix;
          import.assumptions.push_back(
              fmt::format("origin: the first fix of {}, latitude {:.7f}, longitude {:.7f} deg, "
                          "height {:.2f} m",
                          s->sensor().name, fix->latitude, fix->longitude, fix->height));
        }
  const bool geographic =
      std::any_of(import.sensors.begin(), import.sensors.end(), [](const auto& s) { return s->is_geographic(); });
  if (origin && geographic) import.frame.emplace(*origin);
}

void set_declination(Import& import) {
  const auto magnetic =
      std::find_if(import.sensors.begin(), import.sensors.end(), [](const auto& s) { return s->needs_declination(); });
  if (magnetic == import.sensors.end()) return;
  const ImportedSensor& sensor = **magnetic;
  if (import.map.declination) {
    import.declination = import.map.declination;
  } else if (!import.map.magnetic_model.empty()) {
    if (!import.frame && !import.map.origin)
      throw Error(
          fmt::format("{}: a magnetic model needs a place; give origin: [latitude, longitude]", sensor.sensor().name));
    const GeographicPoint origin =
        import.map.origin.value_or(import.frame ? import.frame->origin() : GeographicPoint());
    import.declination = magnetic_declination(import.map.magnetic_model, origin, sensor.t(0)) * std::numbers::pi / 180;
  } else if (sensor.sensor().assumed) {
    import.assumptions.push_back(
        fmt::format("declination: 0; {} has magnetic headings, so give declination in a map", sensor.sensor().name));
  } else {
    throw Error(
        fmt::format("{}: {} has magnetic headings; give declination (degrees, east positive) or magnetic_model "
                    "(path of a .wmm file)",
                    sensor.sensor().place, sensor.sensor().name));
  }
}

/// Returns the first and last time of the chaser's motion, and its name for messages.
struct Motion {
  double first = 0, last = 0;
  std::string name;
};
std::optional<Motion> motion_of(const Sensors& sensors) {
  std::optional<Motion> motion;
  for (const auto& s : sensors)
    if (is_odometry(*s)) return Motion{s->t(0), s->t(s->rows() - 1), s->sensor().name};
  for (const auto& s : sensors) {
    if (!is_own_sensor(*s)) continue;
    if (!motion) motion = Motion{s->t(0), s->t(s->rows() - 1), "the chaser's own sensors"};
    motion->first = std::min(motion->first, s->t(0));
    motion->last = std::max(motion->last, s->t(s->rows() - 1));
  }
  return motion;
}

std::string span_text(double first, double last) {
  return fmt::format("{} to {}", time_text_of(first), time_text_of(last));
}

/// Throws Error if a sensor does not overlap the others in time.
void check_clocks(const Sensors& sensors) {
  const ImportedSensor* reference = nullptr;
  for (const auto& s : sensors)
    if (!reference || is_odometry(*s) || (s->sensor().type->name == "imu" && !is_odometry(*reference)))
      reference = s.get();
  const double first = reference->t(0), last = reference->t(reference->rows() - 1);
  for (const auto& s : sensors) {
    const double from = s->t(0), to = s->t(s->rows() - 1);
    if (from <= last && to >= first) continue;
    throw Error(
        fmt::format("{} ({}) and {} ({}) do not overlap in time, so their clocks differ: in the map, change "
                    "the base (time: receive), unit, epoch or offset of the sensor's time",
                    s->sensor().name, span_text(from, to), reference->sensor().name, span_text(first, last)));
  }
}

/// Throws Error if the sensors are not a scenario. `without_rows` has a sentence for each selected stream without rows.
void check_use(const Import& import, const std::vector<std::string>& without_rows) {
  const auto any = [&](auto kind) {
    return std::any_of(import.sensors.begin(), import.sensors.end(), [&](const auto& s) { return kind(*s); });
  };
  if (any(is_own_sensor) || (any(is_odometry) && any(is_of_target))) return;
  std::vector<std::string> names;
  for (const auto& s : import.sensors)
    names.push_back(fmt::format("{} ({})", s->sensor().name, s->sensor().type->name));
  std::string reasons;
  for (const std::string& sentence : without_rows) reasons += "; " + sentence;
  if (!without_rows.empty() && !import.defects.empty()) reasons += "; " + import.defects.back();
  throw Error(fmt::format(
      "{} gives {}, which is not a scenario: it needs the chaser's own sensors (imu, dvl, depth, gps, heading), or "
      "odometry "
      "and a sensor of the target (position, pose, range_bearing, bearing, range); name their streams in a map{}",
      import.source.string(), names.empty() ? "no sensor" : listed(names), reasons));
}

/// Drops the rows of sensors of the target outside the chaser's motion.
void trim_to_motion(Import& import) {
  constexpr double kLargeShare = 0.1;
  const auto motion = motion_of(import.sensors);
  if (!motion) return;
  for (const auto& s : import.sensors) {
    if (!is_of_target(*s)) continue;
    const std::size_t before = s->rows();
    const std::string span = span_text(s->t(0), s->t(before - 1));
    s->trim(motion->first, motion->last, "a time outside that of " + motion->name);
    const std::size_t dropped = before - s->rows();
    if (static_cast<double>(dropped) > kLargeShare * static_cast<double>(before))
      import.findings.push_back(
          fmt::format("{}: {} of {} rows ({}) are outside the time of {} ({}); is its clock right?", s->sensor().name,
                      dropped, before, span, motion->name, span_text(motion->first, motion->last)));
  }
}

/// Adds one sentence about the streams that the map does not use.
void add_other_streams(const Recording& recording, ImportMap& map) {
  constexpr std::size_t kShown = 8;
  std::vector<std::string> others;
  for (const RecordedStream& stream : recording.streams()) {
    const bool used = std::any_of(map.sensors.begin(), map.sensors.end(),
                                  [&](const ImportSensor& s) { return s.stream == stream.name; });
    const bool explained = std::any_of(map.unused.begin(), map.unused.end(), [&](const std::string& sentence) {
      return sentence.starts_with(stream.name + ": ");
    });
    if (!used && !explained && stream.rows > 0) others.push_back(stream.name);
  }
  const std::size_t n = others.size();
  if (n == 0) return;
  if (n > kShown) others.resize(kShown);
  map.unused.push_back(fmt::format("{} other stream{} not imported: {}{}", n, n == 1 ? "" : "s",
                                   fmt::join(others, ", "), n > kShown ? ", …" : ""));
}

}  // namespace

bool has_type(const Import& import, std::string_view type) {
  return std::any_of(import.sensors.begin(), import.sensors.end(),
                     [&](const auto& s) { return s->sensor().type->name == type; });
}

Import import_recording(Recording& recording, ImportMap map, const std::function<void()>& stop) {
  Import import;
  import.source = recording.file();
  import.format = recording.format();
  import.map = std::move(map);
  if (import.map.name.empty()) import.map.name = recording.file().stem().string();
  std::vector<RowRequest> requests;
  for (const ImportSensor& sensor : import.map.sensors) {
    import.sensors.push_back(std::make_unique<ImportedSensor>(sensor, import.map));
    requests.push_back(import.sensors.back()->request());
  }
  recording.read(requests, stop);
  import.defects = recording.defects();
  add_other_streams(recording, import.map);
  std::vector<std::string> without_rows;
  std::erase_if(import.sensors, [&](const auto& s) {  // a rule may select a topic without usable rows
    if (!s->sensor().assumed || s->rows() > 0) return false;
    without_rows.push_back(s->read() == 0
                               ? fmt::format("{}: no row could be read", s->sensor().stream)
                               : fmt::format("{}: no usable row ({})", s->sensor().stream, listed_drops(*s)));
    return true;
  });
  require_rows(import);
  check_use(import, without_rows);
  for (std::string& sentence : without_rows) import.map.unused.push_back(std::move(sentence));
  set_frame(import);
  set_declination(import);
  for (const auto& s : import.sensors) s->finish(import.frame, import.declination.value_or(0));
  check_clocks(import.sensors);
  trim_to_motion(import);
  require_rows(import);
  std::vector<SensorSeries> series;
  for (const auto& s : import.sensors) {
    if (s->backwards() > 0)
      import.findings.push_back(
          fmt::format("{}: the time runs backwards {} times; the rows are sorted", s->sensor().name, s->backwards()));
    for (std::string& finding : s->findings()) import.findings.push_back(std::move(finding));
    const bool turned = has_setting(s->sensor().settings, "orientation");
    series.push_back({s->sensor().name,
                      std::string(s->sensor().type->name),
                      s->rows(),
                      {},
                      [&sensor = *s](std::size_t row, std::size_t column) { return sensor.at(row, column); },
                      turned});
  }
  for (std::string& sentence : assumed_conventions(import)) import.assumptions.push_back(std::move(sentence));
  for (std::string& finding : series_findings(series, import.map.ned)) import.findings.push_back(std::move(finding));
  return import;
}

}  // namespace tandem
