#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/studies/import/import_report.hpp>
#include <tandem/studies/import/known_messages.hpp>
#include <tandem/studies/inspection/sensor_series.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

double rate_of(const RecordedStream& s) {
  return s.rows > 1 && s.last > s.first ? double(s.rows - 1) / (s.last - s.first) : 0;
}

/// Returns the fields on few lines: arrays are shown by their number of elements.
std::string fields_text(const RecordedStream& stream) {
  std::vector<std::pair<std::string, std::size_t>> names;  // name without its last index, and number of elements
  std::map<std::string, std::size_t> arrays;               // index of each array; later rows may have added elements
  std::vector<std::string> units;
  for (const RecordedField& field : stream.fields) {
    std::string name = field.name;
    const bool element = name.ends_with(']') && !name.ends_with("[]") && name.find('[') != std::string::npos &&
                         name.find_first_not_of("0123456789", name.rfind('[') + 1) == name.size() - 1;
    if (element) name.resize(name.rfind('['));
    if (const auto array = arrays.find(name); element && array != arrays.end()) {
      ++names[array->second].second;
      continue;
    }
    if (element) arrays[name] = names.size();
    names.emplace_back(name, element ? 1 : 0);
    units.push_back(field.unit);
  }
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto& [name, count] = names[i];
    std::string text = count > 1 ? fmt::format("{}[0..{}]", name, count - 1) : count == 1 ? name + "[0]" : name;
    const bool stated = !units[i].empty() && name.find(units[i]) == std::string::npos;
    texts.push_back(stated ? fmt::format("{} ({})", text, units[i]) : text);
  }
  return wrapped(fmt::format("    {}", fmt::join(texts, ", ")), 110, 4);
}

JsonFields<Recording> list_fields() {
  using S = RecordedStream;
  const auto finite = [](double t) { return std::isfinite(t) ? std::optional(t) : std::nullopt; };
  return JsonFields<Recording>()
      .add("source", "file or folder", [](const Recording& r) { return r.file().string(); })
      .add("format", "format of the source", [](const Recording& r) { return r.format(); })
      .add_list("streams", "streams of the source",
                JsonFields<S>()
                    .add("name", "name", [](const S& s) { return s.name; })
                    .add("type", "message type", [](const S& s) { return s.type; })
                    .add("known", "whether its meaning is known without a map",
                         [](const S& s) { return !known_message(s).empty(); })
                    .add("rows", "number of rows", [](const S& s) { return s.rows; })
                    .add("rate_hz", "mean rate [Hz]", [](const S& s) { return rate_of(s); })
                    .add("first", "time of the first row [s]", [finite](const S& s) { return finite(s.first); })
                    .add("last", "time of the last row [s]", [finite](const S& s) { return finite(s.last); })
                    .add("time_field", "field of the time of validity", [](const S& s) { return s.time_field; })
                    .add("unreadable", "why the rows cannot be decoded",
                         [](const S& s) { return s.unreadable.empty() ? std::nullopt : std::optional(s.unreadable); })
                    .add_list("fields", "fields of the stream",
                              JsonFields<RecordedField>()
                                  .add("name", "name", [](const RecordedField& f) { return f.name; })
                                  .add("unit", "unit that the source states",
                                       [](const RecordedField& f) {
                                         return f.unit.empty() ? std::nullopt : std::optional(f.unit);
                                       }),
                              [](const S& s) -> const std::vector<RecordedField>& { return s.fields; }),
                [](const Recording& r) -> const std::vector<S>& { return r.streams(); })
      .add("defects", "defects of the file", [](const Recording& r) { return r.defects(); });
}

}  // namespace

std::string stream_list(const Recording& recording) {
  std::string text =
      fmt::format("{}: {}, {} streams\n", recording.file().string(), recording.format(), recording.streams().size());
  for (const RecordedStream& s : recording.streams()) {
    text += fmt::format("\n{}", s.name);
    if (!s.type.empty()) text += fmt::format("  {}{}", s.type, known_message(s).empty() ? "" : " (known)");
    text += fmt::format("\n    {} rows", s.rows);
    if (const double rate = rate_of(s); rate > 0) text += fmt::format(", {:.3g} Hz", rate);
    if (std::isfinite(s.first)) text += fmt::format(", {} to {}", time_text_of(s.first), time_text_of(s.last));
    if (!s.time_field.empty()) text += fmt::format(", time {}", s.time_field);
    text += '\n';
    if (!s.unreadable.empty()) text += fmt::format("    cannot be decoded: {}\n", s.unreadable);
    if (!s.fields.empty()) text += fields_text(s) + "\n";
  }
  if (!recording.defects().empty()) text += "\ndefects of the file\n";
  for (const std::string& defect : recording.defects()) text += fmt::format("  {}\n", defect);
  return text;
}

std::string stream_list_json(const Recording& recording) {
  return json_text(json_document("import-list", list_fields(), recording));
}

FileDescription stream_list_json_keys() { return describe_json("--list --json", "import-list", list_fields()); }

}  // namespace tandem
