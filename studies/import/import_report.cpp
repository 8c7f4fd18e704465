#include <algorithm>
#include <cmath>
#include <functional>

#include <fmt/format.h>

#include <tandem/studies/import/import_report.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/text.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

double rate(std::size_t rows, double span) { return rows > 1 && span > 0 ? double(rows - 1) / span : 0; }

double span_of(const ImportedSensor& s) { return s.t(s.rows() - 1) - s.t(0); }

/// Returns "range_m [m], bearing_deg [deg]": the fields of a sensor with their units.
std::string fields_text(const ImportSensor& sensor) {
  std::string text;
  for (const auto& [quantity, fields] : sensor.fields)
    for (const ImportField& f : fields) {
      if (!text.empty()) text += ", ";
      if (f.field.empty()) {
        text += fmt::format("{:g}", f.constant);
        continue;
      }
      text += (f.factor < 0 ? "-" : "") + f.field;
      if (!f.unit.empty()) text += fmt::format(" [{}]", f.unit);
    }
  return text;
}

std::string time_base(const ImportSensor& sensor) {
  if (sensor.time.receive) return "receive time";
  return sensor.time.field.field + (sensor.time.field.unit.empty() ? "" : fmt::format(" [{}]", sensor.time.field.unit));
}

std::string heading(const char* text) { return fmt::format("\n{}\n", text); }

}  // namespace

std::string import_report(const Import& import) {
  using enum TextTable::Align;
  TextTable table(
      {{"sensor", left}, {"type", left}, {"stream", left}, {"read"}, {"written"}, {"span [s]"}, {"rate [Hz]"}});
  for (const auto& s : import.sensors) {
    const double span = span_of(*s);
    table.row({s->sensor().name, std::string(s->sensor().type->name), s->sensor().stream, fmt::format("{}", s->read()),
               fmt::format("{}", s->rows()), fmt::format("{:.1f}", span),
               fmt::format("{:.3g}", rate(s->rows(), span))});
  }
  std::string text = fmt::format("{}: {}\n\n{}", import.source.string(), import.format, table.str());
  text += heading("fields");
  for (const auto& s : import.sensors)
    text += fmt::format("  {}: time {}; {}; axes {}-{}\n", s->sensor().name, time_base(s->sensor()),
                        fields_text(s->sensor()), s->sensor().axes.world, s->sensor().axes.body);
  text += heading("dropped");
  bool any = false;
  for (const auto& s : import.sensors)
    for (const auto& [reason, dropped] : s->dropped()) {
      text += fmt::format("  {}: {} row{}: {} (first: {})\n", s->sensor().name, dropped.count,
                          dropped.count == 1 ? "" : "s", reason, dropped.example);
      any = true;
    }
  for (const std::string& unused : import.map.unused) text += fmt::format("  {}\n", unused);
  if (!any && import.map.unused.empty()) text += "  nothing\n";
  for (const auto& [title, sentences] : {std::pair{"assumed", &import.assumptions},
                                         {"defects of the file", &import.defects},
                                         {"looks wrong", &import.findings}}) {
    if (sentences->empty() && std::string_view(title) != "looks wrong") continue;
    text += heading(title);
    for (const std::string& sentence : *sentences) text += fmt::format("  {}\n", sentence);
    if (sentences->empty()) text += "  nothing\n";
  }
  return text;
}

namespace {

struct DroppedEntry {
  std::string reason;
  DroppedRows rows;
};

JsonFields<ImportedSensor> sensor_fields() {
  using S = ImportedSensor;
  return JsonFields<S>()
      .add("name", "name of the sensor", [](const S& s) { return s.sensor().name; })
      .add("type", "type of the sensor", [](const S& s) { return std::string(s.sensor().type->name); })
      .add("stream", "stream of the source", [](const S& s) { return s.sensor().stream; })
      .add("file", "file in the scenario", [](const S& s) { return s.file(); })
      .add("fields", "fields that were used, with their units", [](const S& s) { return fields_text(s.sensor()); })
      .add("time", "time base", [](const S& s) { return time_base(s.sensor()); })
      .add("read", "number of rows read", [](const S& s) { return s.read(); })
      .add("written", "number of rows written", [](const S& s) { return s.rows(); })
      .add("first", "time of the first row [s]", [](const S& s) { return s.t(0); })
      .add("last", "time of the last row [s]", [](const S& s) { return s.t(s.rows() - 1); })
      .add_list(
          "dropped", "rows dropped, by reason",
          JsonFields<DroppedEntry>()
              .add("reason", "reason", [](const DroppedEntry& d) { return d.reason; })
              .add("rows", "number of rows", [](const DroppedEntry& d) { return d.rows.count; })
              .add("first", "line, time and value of the first", [](const DroppedEntry& d) { return d.rows.example; }),
          [](const S& s) {
            std::vector<DroppedEntry> entries;
            for (const auto& [reason, rows] : s.dropped()) entries.push_back({reason, rows});
            return entries;
          });
}

struct WrittenImport {
  const Import& import;
  std::string folder;
};

JsonFields<WrittenImport> import_fields() {
  using I = WrittenImport;
  JsonFields<I> fields;
  fields.add("source", "file or folder that was read", [](const I& i) { return i.import.source.string(); })
      .add("format", "format of the source", [](const I& i) { return i.import.format; })
      .add("folder", "the written scenario folder", [](const I& i) { return i.folder; })
      .add("frame", "axes of the scenario", [](const I& i) { return i.import.map.ned ? "NED-FRD" : "ENU-FLU"; })
      .add("origin", "latitude, longitude [deg] and height [m] of the origin, if positions are geographic",
           [](const I& i) -> std::optional<std::vector<double>> {
             if (!i.import.frame) return {};
             const GeographicPoint& o = i.import.frame->origin();
             return std::vector{o.latitude, o.longitude, o.height};
           });
  fields.add_list("sensors", "imported sensors", sensor_fields(), [](const I& i) {
    std::vector<std::reference_wrapper<const ImportedSensor>> sensors;
    for (const auto& s : i.import.sensors) sensors.push_back(*s);
    return sensors;
  });
  fields
      .add("unused", "streams of known messages that were not used, with the reason",
           [](const I& i) { return i.import.map.unused; })
      .add("assumptions", "values that neither the map nor the data state",
           [](const I& i) { return i.import.assumptions; })
      .add("defects", "defects of the file", [](const I& i) { return i.import.defects; })
      .add("findings", "suspicious data, one sentence each", [](const I& i) { return i.import.findings; });
  return fields;
}

}  // namespace

std::string import_json(const Import& import, const std::string& folder) {
  return json_text(json_document("import", import_fields(), WrittenImport{import, folder}));
}

FileDescription import_json_keys() { return describe_json("--json", "import", import_fields()); }

}  // namespace tandem
