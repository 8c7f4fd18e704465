#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/import/import_entry.hpp>
#include <tandem/studies/import/import_field.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Keys of a sensor that describe its data. All other keys go to scenario.yaml.
const std::vector<std::string> kDataKeys = {"type", "from",  "time",       "latency",     "fields",
                                            "axes", "where", "covariance", "euler_order", "north"};
const std::vector<std::string> kSettings = {"sigma",
                                            "position",
                                            "orientation",
                                            "target_position",
                                            "target_orientation",
                                            "delay",
                                            "loss",
                                            "orientation_loss",
                                            "error",
                                            "accelerometer",
                                            "gyroscope",
                                            "accelerometer_bias_walk",
                                            "gyroscope_bias_walk",
                                            "integration",
                                            "initial_accelerometer_bias",
                                            "initial_gyroscope_bias",
                                            "max_gap",
                                            "max_specific_force",
                                            "max_angular_rate"};

class EntryReader {
 public:
  explicit EntryReader(const ImportEntry& entry) : entry_(entry), stream_(*entry.stream) {}

  ImportSensor read() {
    sensor_.name = entry_.name;
    sensor_.stream = stream_.name;
    sensor_.assumed = !entry_.given;
    sensor_.place = entry_.given ? entry_.given->place("type") : stream_.name;
    if (!stream_.unreadable.empty()) fail("from", fmt::format("{}: {}", stream_.name, stream_.unreadable));
    if (entry_.given) allow_only();
    read_type();
    read_axes_and_north();
    read_fields();
    check_fields();
    check_effect();
    read_time();
    if (has("latency")) sensor_.latency = field_of("latency", section("latency").text("latency"), Quantity::time);
    if (has("where"))
      for (const std::string& text : section("where").texts("where")) sensor_.conditions.push_back(condition(text));
    if (has("covariance"))
      for (const std::string& text : section("covariance").texts("covariance"))
        if (find_field(stream_, text) || given("covariance"))
          sensor_.variances.push_back(field_of("covariance", text, Quantity::number));
    read_settings();
    const auto anywhere = [&](const char* key) { return has(key) || (entry_.map && entry_.map->has(key)); };
    sensor_.fields_by_rule = rule_has("fields") && !given("fields");
    sensor_.axes_stated = anywhere("axes") || (entry_.map && entry_.map->has("frame"));
    sensor_.time_stated = anywhere("time") || sensor_.fields_by_rule;
    sensor_.north_stated = has("north") || sensor_.fields_by_rule;
    return std::move(sensor_);
  }

 private:
  /// Returns whether the rule gives a key. For a type other than its own, only its fields and axes apply.
  bool rule_has(const std::string& key) const {
    if (!entry_.rule || !entry_.rule->has(key)) return false;
    const bool same_type =
        !entry_.given || !entry_.given->has("type") || entry_.given->text("type") == entry_.rule->text("type");
    return same_type || key == "fields" || key == "axes";
  }
  /// Returns whether the user's entry gives a key.
  bool given(const std::string& key) const { return entry_.given && entry_.given->has(key); }
  bool has(const std::string& key) const { return given(key) || rule_has(key); }
  /// Returns the section that has the key: that of the user's map if possible, otherwise that of the rule.
  const YamlSection& section(const std::string& key) const {
    return entry_.given && (entry_.given->has(key) || !rule_has(key)) ? *entry_.given : *entry_.rule;
  }
  [[noreturn]] void fail(const std::string& key, const std::string& why) const { section(key).fail(key, why); }

  void allow_only() const {
    std::vector<std::string> known = kDataKeys;
    known.insert(known.end(), kSettings.begin(), kSettings.end());
    for (const std::string& key : entry_.given->keys())
      for (const ImportType& type : import_types())
        for (const ImportPart part : type.parts)
          for (const ImportQuantity& quantity : quantities(part))
            if (key == quantity.name && std::find(known.begin(), known.end(), key) == known.end())
              fail(key, fmt::format("{0} is a quantity; put it into fields: {{{0}: …}}", key));
    entry_.given->allow_only(known);
  }

  void read_type() {
    if (!has("type"))
      fail("", fmt::format("{} lacks the key type; types are {}", entry_.name, listed(import_type_names())));
    const std::string type = section("type").text("type");
    sensor_.type = find_import_type(type);
    if (!sensor_.type)
      fail("type", fmt::format("unknown type {}{} (types: {})", quote(type), did_you_mean(type, import_type_names()),
                               fmt::join(import_type_names(), ", ")));
  }

  void read_axes_and_north() {
    ImportAxes axes;
    if (entry_.map && entry_.map->has("frame") && entry_.map->text("frame") == "NED-FRD") axes = {"NED", "FRD"};
    if (entry_.map) axes = read_axes(*entry_.map, axes);
    if (entry_.rule) axes = read_axes(*entry_.rule, axes);
    if (entry_.given) axes = read_axes(*entry_.given, axes);
    sensor_.axes = axes;
    if (!has("north")) return;
    const std::string north = section("north").text("north");
    if (north != "magnetic" && north != "true")
      fail("north", fmt::format("north is {}; it must be true or magnetic", quote(north)));
    sensor_.magnetic = north == "magnetic";
  }

  /// Returns the field of an expression; see import_field().
  ImportField field_of(const std::string& key, std::string_view text, Quantity quantity) const {
    return import_field(stream_, fmt::format("{}: {}", place(key), key), text, quantity);
  }

  std::string place(const std::string& key) const { return given(key) ? entry_.given->place(key) : sensor_.place; }

  void read_fields() {
    if (!has("fields")) {
      std::vector<std::string> names;
      for (const ImportPart part : sensor_.type->parts)
        for (const ImportQuantity& quantity : quantities(part)) names.emplace_back(quantity.name);
      fail("type",
           fmt::format("{} lacks the key fields; a {} takes {}", entry_.name, sensor_.type->name, listed(names)));
    }
    const YamlSection fields = section("fields").section("fields");
    std::vector<std::string> known;
    for (const ImportPart part : sensor_.type->parts)
      for (const ImportQuantity& quantity : quantities(part)) {
        known.emplace_back(quantity.name);
        if (fields.has(std::string(quantity.name))) read_quantity(fields, quantity);
      }
    if (given("fields")) fields.allow_only(known);  // a rule may have more than the type
  }

  void read_quantity(const YamlSection& fields, const ImportQuantity& quantity) {
    const std::string name(quantity.name);
    if (sensor_.find(name)) return;  // both parts of a type may take it
    std::vector<std::string> texts = fields.texts(name);
    if (name == "position" && texts.size() == 2 && (fields.has("depth") || fields.has("height")))
      texts.emplace_back("=0");  // replaced by depth or height
    if (texts.size() != static_cast<std::size_t>(quantity.count))
      fields.fail(name, fmt::format("{} takes {} field{}, not {} (=NUMBER stands for a constant)", name, quantity.count,
                                    quantity.count == 1 ? "" : "s", texts.size()));
    std::vector<ImportField> of_quantity;
    for (const std::string& text : texts) {
      of_quantity.push_back(field_of("fields", text, quantity.quantity));
      ImportField& field = of_quantity.back();
      if ((name == "latitude" || name == "longitude") && field.unit.empty() && !field.field.empty()) {
        field.factor *= std::acos(-1.0) / 180;
        field.unit = "deg";
      }
    }
    sensor_.fields.emplace_back(name, std::move(of_quantity));
  }

  void require(bool condition, const std::string& what) const {
    if (!condition) fail("fields", fmt::format("{}: a {} needs {} in fields", entry_.name, sensor_.type->name, what));
  }

  void check_fields() {
    const auto has_quantity = [&](const char* name) { return sensor_.find(name) != nullptr; };
    for (const ImportPart part : sensor_.type->parts) switch (part) {
        case ImportPart::world_position:
          require(has_quantity("position") || (has_quantity("latitude") && has_quantity("longitude")),
                  "position, or latitude and longitude");
          if (has_quantity("position") && has_quantity("latitude"))
            fail("fields", fmt::format("{}: give `position`, or `latitude` and `longitude`, not both", entry_.name));
          break;
        case ImportPart::world_orientation:
        case ImportPart::body_orientation:
          check_orientation(has_quantity);
          break;
        case ImportPart::height:
          require(has_quantity("depth") || has_quantity("height") || has_quantity("pressure"),
                  "depth (positive down), height (positive up) or pressure");
          break;
        default:
          for (const ImportQuantity& quantity : quantities(part))
            require(has_quantity(std::string(quantity.name).c_str()), std::string(quantity.name));
      }
  }

  template <class Has>
  void check_orientation(Has has_quantity) {
    int ways = 0;
    for (const char* way : {"quaternion_xyzw", "quaternion_wxyz", "euler", "yaw", "heading", "magnetic_field"})
      ways += has_quantity(way);
    const bool truth = sensor_.type->name.starts_with("truth");
    if (!truth)
      require(ways > 0,
              "an orientation: quaternion_xyzw, quaternion_wxyz, roll, pitch and yaw (or heading), or heading alone");
    if (ways > 1) fail("fields", fmt::format("{}: the orientation is given in {} ways; keep one", entry_.name, ways));
    if (!has_quantity("euler")) return;
    if (!has("euler_order"))
      fail("fields", fmt::format("{}: the order of three Euler angles is ambiguous; give euler_order, for example zyx "
                                 "(yaw, then pitch, then roll about the turned axes), or use roll, pitch and yaw",
                                 entry_.name));
    sensor_.euler_order = section("euler_order").text("euler_order");
    std::string sorted = sensor_.euler_order;
    std::sort(sorted.begin(), sorted.end());
    const std::string& o = sensor_.euler_order;
    const bool proper =
        o.size() == 3 && o.find_first_not_of("xyz") == std::string::npos && o[0] != o[1] && o[1] != o[2];
    if (!proper)
      fail("euler_order", fmt::format("euler_order {} must have three letters, each x, y or z and different from "
                                      "the one before, for example zyx",
                                      quote(o)));
  }

  /// Throws Error if a key describes a quantity that the sensor does not have.
  void check_effect() const {
    if (given("euler_order") && !sensor_.find("euler"))
      fail("euler_order", fmt::format("euler_order has no effect: {} has no quantity euler; remove it", entry_.name));
    if (given("north") && !has_world_orientation(*sensor_.type))
      fail("north", fmt::format("north has no effect: a {} has no heading; remove it", sensor_.type->name));
  }

  void read_time() {
    ImportTime& time = sensor_.time;
    std::string field, unit;
    time.date_order = stream_.date_order;
    if (entry_.map && entry_.map->has("tables") && entry_.map->section("tables").has("date_order"))
      time.date_order = read_date_order(entry_.map->section("tables"));
    for (const YamlSection* from : {entry_.map, entry_.rule, entry_.given})
      if (from && from->has("time")) read_time_key(*from, field, unit);
    if (time.receive) return;
    if (field.empty()) field = stream_.time_field;
    if (field == stream_.time_field && time.date == 0 && time.date_field.empty()) time.date_field = stream_.date_field;
    if (field.empty()) {
      time.receive = std::isfinite(stream_.first);
      if (time.receive) return;
      fail("time",
           fmt::format("{}: {} has no field that is a time by its name; give time: FIELD", entry_.name, stream_.name));
    }
    const bool stated = field.ends_with(']') && !find_field(stream_, field);
    time.field = field_of("time", stated || unit.empty() ? field : fmt::format("{} [{}]", field, unit), Quantity::time);
  }

  void read_time_key(const YamlSection& from, std::string& field, std::string& unit) {
    ImportTime& time = sensor_.time;
    if (!from.is_mapping("time")) {
      const std::string text = from.text("time");
      time.receive = text == "receive";
      if (text == "message") {
        field = stream_.time_field;
      } else if (!time.receive) {
        if (&from != entry_.map || find_field(stream_, text) || find_field(stream_, text.substr(0, text.find(" ["))))
          field = text;
      }
      return;
    }
    const YamlSection keys = from.section("time");
    keys.allow_only({"field", "unit", "epoch", "leap_seconds", "offset", "week", "date", "base"});
    if (keys.has("base")) {
      const std::string base = keys.text("base");
      if (base != "receive" && base != "message")
        keys.fail("base", fmt::format("base is {}; it must be message or receive", quote(base)));
      time.receive = base == "receive";
    }
    if (keys.has("field")) field = keys.text("field");
    if (keys.has("unit")) unit = keys.text("unit");
    if (keys.has("week")) time.week = keys.text("week");
    if (!time.week.empty()) {
      const RecordedField* found = find_field(stream_, time.week);
      if (!found) keys.fail("week", unknown_field(stream_, time.week));
      time.week = found->name;
    }
    if (keys.has("epoch")) {
      const std::string epoch = keys.text("epoch");
      if (epoch != "unix" && epoch != "gps")
        keys.fail("epoch", fmt::format("epoch is {}; it must be unix (1970) or gps (1980)", quote(epoch)));
      time.gps = epoch == "gps";
    }
    if (keys.has("leap_seconds")) time.leap_seconds = keys.number("leap_seconds");
    if (keys.has("offset")) time.offset = keys.number("offset");
    if (!keys.has("date")) return;
    const std::string text = keys.text("date");
    const auto date = parse_time_text(text, time.date_order);
    if (date)
      time.date = *date;
    else if (const RecordedField* found = find_field(stream_, text))
      time.date_field = found->name;
    else
      keys.fail("date", fmt::format("date {} is neither a date like 2024-11-26 nor a field", quote(text)));
  }

  ImportCondition condition(const std::string& text) const {
    using enum ImportCondition::Op;
    for (const auto& [symbol, op] : {std::pair{"!=", not_equal},
                                     {"<=", less_equal},
                                     {">=", greater_equal},
                                     {"=", equal},
                                     {"<", less},
                                     {">", greater}}) {
      const std::size_t at = text.find(symbol);
      if (at == std::string::npos || at == 0) continue;
      std::string field(trimmed(std::string_view(text).substr(0, at)));
      std::string value(trimmed(std::string_view(text).substr(at + std::string_view(symbol).size())));
      if (value.starts_with('=')) value = std::string(trimmed(std::string_view(value).substr(1)));  // "=="
      const RecordedField* found = find_field(stream_, field);
      if (!found && given("where"))
        throw Error(fmt::format("{}: where: {}", place("where"), unknown_field(stream_, field)));
      if (!found) return {};  // a rule's condition on a field that this version of the message lacks
      if (field.find('[') == std::string::npos) field = found->name;
      return {field, op, value, parse_number(value).value_or(std::nan(""))};
    }
    fail("where", fmt::format("where: {} is not of the form FIELD = VALUE (or !=, <, <=, >, >=)", quote(text)));
  }

  void read_settings() {
    std::erase_if(sensor_.conditions, [](const ImportCondition& c) { return c.field.empty(); });
    for (const std::string& key : kSettings)
      if (has(key))
        sensor_.settings.push_back({key, key == "sigma" ? sigma_line() : section(key).line(key),
                                    fmt::format("{}: {}", place(key), sensor_.name)});
  }

  /// Returns the standard deviations in SI units: "1.5 deg" becomes 0.026….
  std::string sigma_line() const {
    std::string line;
    const std::vector<std::string> texts = section("sigma").texts("sigma");
    const std::vector<Quantity> expected = sigma_quantities(*sensor_.type);
    for (std::size_t i = 0; i < texts.size(); ++i) {
      const std::vector<std::string_view> parts = words(texts[i]);
      auto number = parts.empty() ? std::nullopt : parse_number(parts[0]);
      if (!number || parts.size() > 2)
        fail("sigma", fmt::format("{} is not a standard deviation; write a number, or \"1.5 deg\"", quote(texts[i])));
      if (parts.size() == 2) {
        const auto unit = find_unit(parts[1]);
        if (!unit || unit->factor == 0)
          fail("sigma", fmt::format("unknown unit {} of a standard deviation", quote(parts[1])));
        if (i < expected.size() && unit->quantity != expected[i])
          fail("sigma", fmt::format("{}: {} is a unit of {}, but number {} of sigma is in {}", sensor_.name, parts[1],
                                    name(unit->quantity), i + 1, si_unit(expected[i])));
        *number *= unit->factor;
      }
      line += fmt::format("{}{:.6g}", line.empty() ? "[" : ", ", *number);
    }
    return line + "]";
  }

  const ImportEntry& entry_;
  const RecordedStream& stream_;
  ImportSensor sensor_;
};

}  // namespace

DateOrder read_date_order(const YamlSection& tables) {
  const std::string order = tables.text("date_order");
  if (order == "dmy") return DateOrder::dmy;
  if (order == "mdy") return DateOrder::mdy;
  tables.fail("date_order", fmt::format("date_order is {}; it must be dmy (day/month/year) or mdy", quote(order)));
}

ImportSensor read_import_entry(const ImportEntry& entry) { return EntryReader(entry).read(); }

}  // namespace tandem
