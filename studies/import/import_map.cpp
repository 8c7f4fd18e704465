#include <algorithm>
#include <cctype>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/import/import_entry.hpp>
#include <tandem/studies/import/import_map.hpp>
#include <tandem/studies/import/known_messages.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Keys of scenario.yaml that a map passes on.
const std::vector<std::string> kPassedOn = {"description", "source",  "licence",          "keyframe_interval",
                                            "latitude",    "gravity", "truth_orientation"};

char delimiter_of(const YamlSection& section) {
  const std::string text = section.text("delimiter");
  if (text == "tab" || text == "\t" || text == "\\t") return '\t';
  if (text == "blank" || text == "space" || text.empty() || text == " ") return ' ';
  if (text.size() == 1) return text.front();
  section.fail("delimiter", fmt::format("delimiter {} must be one character, tab or blank", quote(text)));
}

std::vector<std::string> stream_names(const Recording& recording) {
  std::vector<std::string> names;
  for (const RecordedStream& stream : recording.streams()) names.push_back(stream.name);
  return names;
}

const RecordedStream& stream_of(const YamlSection& entry, const std::string& name, const Recording& recording) {
  const std::string wanted = entry.has("from") ? entry.text("from") : name;
  if (const RecordedStream* stream = recording.find(wanted)) return *stream;
  const std::vector<std::string> names = stream_names(recording);
  entry.fail(entry.has("from") ? "from" : "",
             fmt::format("{} has no stream {}{} (streams: {})", recording.file().string(), quote(wanted),
                         did_you_mean(wanted, names), fmt::join(names, ", ")));
}

GeographicPoint read_origin(const YamlSection& map) {
  const std::vector<double> numbers = map.numbers("origin");
  if (numbers.size() != 2 && numbers.size() != 3)
    map.fail("origin", "origin takes [latitude, longitude] in degrees and optionally the height in m");
  if (std::abs(numbers[0]) > 90)
    map.fail("origin", fmt::format("the latitude {:g} of the origin is outside [-90, 90] degrees", numbers[0]));
  return {numbers[0], numbers[1], numbers.size() == 3 ? numbers[2] : 0};
}

/// Reads the settings of the whole import.
void read_head(const YamlSection& map, ImportMap& result) {
  std::vector<std::string> known = kPassedOn;
  for (const char* key : {"name", "frame", "time", "tables", "sensors", "noise", "origin", "declination",
                          "magnetic_model", "water", "axes"})
    known.emplace_back(key);
  map.allow_only(known);
  if (map.has("name")) result.name = map.text("name");
  if (map.has("frame")) {
    const std::string frame = map.text("frame");
    if (frame != "NED-FRD" && frame != "ENU-FLU")
      map.fail("frame", fmt::format("unknown frame {}; the scenario can be in ENU-FLU or NED-FRD (give the axes of a "
                                    "sensor's data by its key axes)",
                                    quote(frame)));
    result.ned = frame == "NED-FRD";
    result.frame_stated = true;
  }
  if (map.has("origin")) result.origin = read_origin(map);
  if (map.has("declination")) result.declination = map.number("declination") * std::acos(-1.0) / 180;
  if (map.has("magnetic_model")) result.magnetic_model = map.text("magnetic_model");
  if (map.has("water")) {
    const YamlSection water = map.section("water");
    water.allow_only({"density", "atmosphere"});
    if (water.has("density")) result.density = water.number("density");
    if (water.has("atmosphere")) result.atmosphere = water.number("atmosphere");
    if (!(result.density > 0)) water.fail("density", "density must be above zero; it is in kg/m^3");
    result.water_given = true;
  }
  for (const std::string& key : kPassedOn)
    if (map.has(key)) result.settings.push_back({key, map.line(key), map.place(key)});
  if (map.has("noise")) {
    const YamlSection noise = map.section("noise");
    for (const std::string& key : noise.keys()) result.noise.push_back({key, noise.line(key), noise.place(key)});
  }
}

/// Throws Error if the map has a key that no sensor uses.
void check_effect(const YamlSection& map, const ImportMap& result) {
  const auto any = [&](auto uses) { return std::any_of(result.sensors.begin(), result.sensors.end(), uses); };
  const bool magnetic = any([](const ImportSensor& s) { return s.magnetic && has_world_orientation(*s.type); });
  for (const char* key : {"declination", "magnetic_model"})
    if (map.has(key) && !magnetic)
      map.fail(key, fmt::format("{} has no effect, since no heading is magnetic; give north: magnetic to the sensors "
                                "whose headings it turns, or remove it",
                                key));
  if (map.has("declination") && map.has("magnetic_model"))
    map.fail("magnetic_model", "magnetic_model has no effect beside declination; remove one of them");
  if (map.has("water") && !any([](const ImportSensor& s) { return s.find("pressure") != nullptr; }))
    map.fail("water", "water has no effect, since no depth is given by a pressure; remove it");
}

/// Throws Error if the field with the time, given for all sensors, is in no stream.
void check_time(const YamlSection& map, const Recording& recording) {
  if (!map.has("time") || map.is_mapping("time")) return;
  const std::string text = map.text("time"), field = text.substr(0, text.find(" ["));
  if (text == "message" || text == "receive") return;
  std::vector<std::string> names{"message", "receive"};
  for (const RecordedStream& stream : recording.streams()) {
    if (find_field(stream, text) || find_field(stream, field)) return;
    for (const RecordedField& f : stream.fields)
      if (!parse_positive_integer(f.name)) names.push_back(f.name);
  }
  map.fail("time", fmt::format("no stream has the field {}{}", quote(field), did_you_mean(field, names)));
}

void check_once(const YamlSection& sensors, const ImportMap& map, const ImportSensor& added) {
  const auto same = [&](const ImportSensor& s) {
    return s.type == added.type && (!added.type->file.empty() || added.type->name == "imu");
  };
  if (const auto other = std::find_if(map.sensors.begin(), map.sensors.end(), same); other != map.sensors.end())
    sensors.fail(added.name, fmt::format("{} and {} are both of type {}; a scenario has only one", other->name,
                                         added.name, added.type->name));
}

/// Throws Error if an entry gives axes of the world to a type that has quantities of a body only, or the reverse.
void check_axes(const YamlSection& entry, const ImportType& type) {
  if (!entry.has("axes")) return;
  const ImportAxes given = read_axes(entry, {"", ""});
  const auto any = [&](auto... parts) {
    return std::any_of(type.parts.begin(), type.parts.end(), [&](ImportPart p) { return ((p == parts) || ...); });
  };
  using enum ImportPart;
  const bool in_world = any(world_position, world_orientation);
  const bool along_body =
      any(world_orientation, body_position, body_orientation, velocity, acceleration, angular_rate, direction);
  if (along_body && !in_world && given.body.empty())
    entry.fail("axes",
               fmt::format("axes {} are those of the world, but a {} is along the axes of the body: give FRD, FLU "
                           "or {{x: forward, y: starboard, z: down}}",
                           given.world, type.name));
  if (in_world && !along_body && given.world.empty())
    entry.fail("axes", fmt::format("axes {} are those of a body, but a {} is along the axes of the world: give NED or "
                                   "ENU",
                                   given.body, type.name));
}

/// Adds what the stream and its rule, if it has one, state beside the entry.
void complete(ImportSensor& sensor, const RecordedStream& stream, const YamlSection* rule) {
  if (rule && rule->has("frame") && find_field(stream, rule->text("frame"))) sensor.frame_field = rule->text("frame");
  if (!sensor.time.receive && sensor.time.field.field == stream.time_field) sensor.time_note = stream.time_note;
}

/// Returns a sensor name for a stream name: "usbl_fix" for "/usbl/fix".
std::string sensor_name(const std::string& stream, const std::vector<ImportSensor>& others) {
  std::string name;
  for (const char c : stream)
    if (std::isalnum(static_cast<unsigned char>(c)))
      name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    else if (!name.empty() && name.back() != '_')
      name += '_';
  while (!name.empty() && name.back() == '_') name.pop_back();
  if (name.empty()) name = "sensor";
  const auto taken = [&](const std::string& n) {
    return std::any_of(others.begin(), others.end(), [&](const ImportSensor& s) { return s.name == n; });
  };
  std::string unique = name;
  for (int i = 2; taken(unique); ++i) unique = fmt::format("{}_{}", name, i);
  return unique;
}

/// Returns the index of the existing sensor of this type if a scenario can have only one of the type, else nothing.
std::optional<std::size_t> competitor(const ImportMap& map, const ImportType& type) {
  if (type.file.empty() && type.name != "imu" && type.name != "depth") return {};
  for (std::size_t i = 0; i < map.sensors.size(); ++i)
    if (map.sensors[i].type == &type) return i;
  return {};
}

/// Returns the stream of the first of several equal devices of an ArduPilot log, "GPS" for "GPS.1"; null for others.
const RecordedStream* first_device(const RecordedStream& stream, const Recording& recording) {
  const std::string name = stream.name.substr(0, stream.name.find('.'));
  const RecordedStream* first =
      name == stream.name || !stream.type.starts_with("ArduPilot/") ? nullptr : recording.find(name);
  return first && first->rows > 0 ? first : nullptr;
}

}  // namespace

const std::vector<ImportField>* ImportSensor::find(std::string_view quantity) const {
  for (const auto& [name, of_quantity] : fields)
    if (name == quantity) return &of_quantity;
  return nullptr;
}

bool has_setting(const std::vector<ImportSetting>& settings, std::string_view key) {
  return std::any_of(settings.begin(), settings.end(), [&](const auto& entry) { return entry.key == key; });
}

TableSettings read_table_settings(const std::filesystem::path& file) {
  const YamlSection map = YamlSection::load(file);
  TableSettings settings;
  if (!map.has("tables")) return settings;
  const YamlSection tables = map.section("tables");
  tables.allow_only({"delimiter", "header", "decimal_comma", "comment", "missing", "skip", "date_order"});
  if (tables.has("delimiter")) settings.delimiter = delimiter_of(tables);
  if (tables.has("header")) settings.header = tables.boolean("header");
  if (tables.has("decimal_comma")) settings.decimal_comma = tables.boolean("decimal_comma");
  if (tables.has("comment")) settings.comment = tables.text("comment");
  if (tables.has("missing")) settings.missing = tables.texts("missing");
  if (tables.has("date_order")) settings.date_order = read_date_order(tables);
  if (tables.has("skip")) {
    const double skip = tables.number("skip");
    if (skip < 0 || skip != std::floor(skip)) tables.fail("skip", "skip must be a number of lines");
    settings.skip = static_cast<std::size_t>(skip);
  }
  return settings;
}

ImportMap read_import_map(const std::filesystem::path& file, const Recording& recording) {
  const YamlSection map = YamlSection::load(file);
  ImportMap result;
  read_head(map, result);
  check_time(map, recording);
  const YamlSection sensors = map.section("sensors");
  for (const std::string& name : sensors.keys()) {
    const YamlSection entry = sensors.section(name);
    const RecordedStream& stream = stream_of(entry, name, recording);
    const bool magnetic = entry.has("north")
                              ? entry.text("north") == "magnetic"
                              : entry.has("fields") || map.has("declination") || map.has("magnetic_model");
    const std::string_view rule = known_message(stream, magnetic);
    std::optional<YamlSection> known;
    if (!rule.empty()) known = YamlSection::parse(std::string(rule), stream.type);
    ImportSensor sensor = read_import_entry({name, &entry, known ? &*known : nullptr, &map, &stream});
    check_axes(entry, *sensor.type);
    const bool same_type = known && (!entry.has("type") || entry.text("type") == known->text("type"));
    complete(sensor, stream, same_type && !entry.has("where") ? &*known : nullptr);
    check_once(sensors, result, sensor);
    result.sensors.push_back(std::move(sensor));
  }
  if (result.sensors.empty()) map.fail("sensors", "sensors is empty; name at least one");
  check_effect(map, result);
  return result;
}

ImportMap known_import_map(const Recording& recording) {
  ImportMap result;
  for (const RecordedStream& stream : recording.streams()) {
    const auto skip = [&](const std::string& why) { result.unused.push_back(stream.name + ": " + why); };
    const std::string_view rule = known_message(stream);
    if (rule.empty()) continue;
    if (!stream.unreadable.empty() || stream.rows == 0) {
      skip(stream.rows == 0 ? "no rows" : stream.unreadable);
      continue;
    }
    if (const RecordedStream* first = first_device(stream, recording)) {
      skip(fmt::format("{} is the first of these devices; select others in a map (--map)", first->name));
      continue;
    }
    const YamlSection known = YamlSection::parse(std::string(rule), stream.type);
    const std::string name = sensor_name(stream.name, result.sensors);
    try {
      ImportSensor sensor = read_import_entry({name, nullptr, &known, nullptr, &stream});
      complete(sensor, stream, &known);
      if (const auto other = competitor(result, *sensor.type))
        skip(fmt::format("{} already gives the {}; select one of them in a map (--map)", result.sensors[*other].stream,
                         sensor.type->name));
      else
        result.sensors.push_back(std::move(sensor));
    } catch (const Error& error) {  // a version of the message with other fields
      skip(error.what());
    }
  }
  if (result.sensors.empty()) {
    const std::string damage = recording.defects().empty() ? "" : fmt::format(" ({})", recording.defects().front());
    if (recording.streams().empty())
      throw Error(fmt::format("{} has no messages{}", recording.file().string(), damage));
    throw Error(
        fmt::format("{} has no message whose meaning is known{}; list its streams with --list, and name those to "
                    "import in a map (--map)",
                    recording.file().string(), damage));
  }
  return result;
}

}  // namespace tandem
