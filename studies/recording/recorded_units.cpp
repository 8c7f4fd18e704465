#include <algorithm>
#include <cctype>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/recording/recorded_units.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kGravity = 9.80665;     // m/s²
constexpr double kKnot = 1852.0 / 3600;  // m/s
constexpr double kFoot = 0.3048;         // m

constexpr RecordedUnit kUnits[] = {
    {"s", Quantity::time, 1},
    {"ms", Quantity::time, 1e-3},
    {"us", Quantity::time, 1e-6},
    {"ns", Quantity::time, 1e-9},
    {"min", Quantity::time, 60},
    {"h", Quantity::time, 3600},
    {"days", Quantity::time, 86400},
    {"hhmmss", Quantity::time, 0},  // packed time of day
    {"m", Quantity::length, 1},
    {"cm", Quantity::length, 1e-2},
    {"mm", Quantity::length, 1e-3},
    {"km", Quantity::length, 1e3},
    {"ft", Quantity::length, kFoot},
    {"fathom", Quantity::length, 6 * kFoot},
    {"nmi", Quantity::length, 1852},
    {"rad", Quantity::angle, 1},
    {"deg", Quantity::angle, kDegree},
    {"cdeg", Quantity::angle, kDegree * 1e-2},
    {"1e-7deg", Quantity::angle, kDegree * 1e-7},
    {"mrad", Quantity::angle, 1e-3},
    {"gon", Quantity::angle, std::numbers::pi / 200},
    {"ddmm", Quantity::angle, 0},  // degrees and minutes, as in NMEA; see ImportField
    {"m/s", Quantity::speed, 1},
    {"cm/s", Quantity::speed, 1e-2},
    {"mm/s", Quantity::speed, 1e-3},
    {"km/h", Quantity::speed, 1 / 3.6},
    {"kn", Quantity::speed, kKnot},
    {"ft/s", Quantity::speed, kFoot},
    {"m/s^2", Quantity::acceleration, 1},
    {"mg", Quantity::acceleration, kGravity * 1e-3},
    {"g", Quantity::acceleration, kGravity},
    {"cm/s^2", Quantity::acceleration, 1e-2},
    {"rad/s", Quantity::angular_rate, 1},
    {"deg/s", Quantity::angular_rate, kDegree},
    {"mrad/s", Quantity::angular_rate, 1e-3},
    {"deg/h", Quantity::angular_rate, kDegree / 3600},
    {"Pa", Quantity::pressure, 1},
    {"hPa", Quantity::pressure, 100},
    {"kPa", Quantity::pressure, 1e3},
    {"mbar", Quantity::pressure, 100},
    {"bar", Quantity::pressure, 1e5},
    {"dbar", Quantity::pressure, 1e4},
    {"psi", Quantity::pressure, 6894.757293168},
    {"T", Quantity::magnetic_field, 1},
    {"uT", Quantity::magnetic_field, 1e-6},
    {"nT", Quantity::magnetic_field, 1e-9},
    {"mT", Quantity::magnetic_field, 1e-3},
    {"Gauss", Quantity::magnetic_field, 1e-4},
    {"mGauss", Quantity::magnetic_field, 1e-7},
    {"1", Quantity::number, 1},
    {"%", Quantity::number, 1e-2},
};

/// Other spellings of units in column names.
constexpr std::pair<std::string_view, std::string_view> kSpellings[] = {
    {"degrees", "deg"},     {"degree", "deg"},      {"°", "deg"},
    {"degheading", "deg"},  {"deglatitude", "deg"}, {"deglongitude", "deg"},
    {"radian", "rad"},      {"radians", "rad"},     {"gradian", "gon"},
    {"gradians", "gon"},    {"sec", "s"},           {"secs", "s"},
    {"second", "s"},        {"seconds", "s"},       {"msec", "ms"},
    {"milliseconds", "ms"}, {"usec", "us"},         {"µs", "us"},
    {"microseconds", "us"}, {"nsec", "ns"},         {"nanosec", "ns"},
    {"nanoseconds", "ns"},  {"minutes", "min"},     {"hours", "h"},
    {"mtr", "m"},           {"metre", "m"},         {"metres", "m"},
    {"meter", "m"},         {"meters", "m"},        {"centimetres", "cm"},
    {"centimeters", "cm"},  {"millimetres", "mm"},  {"millimeters", "mm"},
    {"kilometres", "km"},   {"kilometers", "km"},   {"foot", "ft"},
    {"feet", "ft"},         {"fathoms", "fathom"},  {"NM", "nmi"},
    {"knot", "kn"},         {"knots", "kn"},        {"kts", "kn"},
    {"kt", "kn"},           {"mps", "m/s"},         {"m_s", "m/s"},
    {"m/sec", "m/s"},       {"cm_s", "cm/s"},       {"mm_s", "mm/s"},
    {"kmh", "km/h"},        {"kph", "km/h"},        {"m/s/s", "m/s^2"},
    {"m/s²", "m/s^2"},      {"m/s2", "m/s^2"},      {"m_s2", "m/s^2"},
    {"rads", "rad/s"},      {"rad_s", "rad/s"},     {"radps", "rad/s"},
    {"rad/sec", "rad/s"},   {"dps", "deg/s"},       {"°/s", "deg/s"},
    {"degps", "deg/s"},     {"deg_s", "deg/s"},     {"deg/sec", "deg/s"},
    {"pascal", "Pa"},       {"millibar", "mbar"},   {"decibar", "dbar"},
    {"tesla", "T"},         {"m s^-1", "m/s"},      {"m s^-2", "m/s^2"},
    {"rad s^-1", "rad/s"},  {"deg s^-1", "deg/s"},  {"ms^-1", "m/s"},
    {"ms^-2", "m/s^2"},     {"m s-1", "m/s"},       {"m s-2", "m/s^2"},
    {"rad s-1", "rad/s"},   {"deg s-1", "deg/s"}};

/// Texts that are used for more than one unit: gon or degrees (German), g or gauss.
constexpr std::string_view kAmbiguous[] = {"grad", "grads", "G"};

/// Returns whether `text` is `unit` in another case, such as "Knots" or "PSI". In "Mm" and "T", the case matters.
bool same_but_for_case(std::string_view text, std::string_view unit) {
  if (text.size() != unit.size() || lower_case(text) != lower_case(unit)) return false;
  if (text.size() == 1) return text == "M" || text == "S";
  const bool mega = text[0] == 'M' && unit[0] == 'm' &&
                    std::any_of(text.begin(), text.end(), [](unsigned char c) { return std::islower(c); });
  constexpr std::string_view kMilli[] = {"ms", "mm", "mg", "mT", "mbar", "mrad", "mm/s", "mrad/s", "mGauss"};
  return !mega || std::find(std::begin(kMilli), std::end(kMilli), unit) == std::end(kMilli);
}

/// Calls f(spelling, unit) for all spellings of all units until it returns true.
template <class F>
std::optional<RecordedUnit> find_spelling(F f) {
  for (const RecordedUnit& unit : kUnits)
    if (f(unit.name)) return unit;
  for (const auto& [spelling, name] : kSpellings)
    if (f(spelling))
      for (const RecordedUnit& unit : kUnits)
        if (unit.name == name) return unit;
  return {};
}

bool is_ambiguous(std::string_view text) {
  return std::any_of(std::begin(kAmbiguous), std::end(kAmbiguous),
                     [&](std::string_view a) { return text == a || (a.size() > 1 && lower_case(text) == a); });
}

/// Returns whether a text in brackets may be a unit. Names of axes ("x", "N") and indices are none.
bool may_be_unit(std::string_view text) {
  return std::any_of(text.begin(), text.end(), [](unsigned char c) { return std::isalpha(c) || c > 127; }) &&
         (text.size() > 1 || is_ambiguous(text));
}

}  // namespace

std::string_view name(Quantity quantity) {
  switch (quantity) {
    case Quantity::time:
      return "time";
    case Quantity::length:
      return "length";
    case Quantity::angle:
      return "angle";
    case Quantity::speed:
      return "speed";
    case Quantity::acceleration:
      return "acceleration";
    case Quantity::angular_rate:
      return "angular rate";
    case Quantity::pressure:
      return "pressure";
    case Quantity::magnetic_field:
      return "magnetic field";
    case Quantity::number:
      return "plain number";
  }
  return "";
}

std::string_view si_unit(Quantity quantity) {
  for (const RecordedUnit& unit : kUnits)
    if (unit.quantity == quantity && unit.factor == 1) return unit.name;
  return "";
}

std::optional<RecordedUnit> find_unit(std::string_view name) {
  if (const auto exact = find_spelling([&](std::string_view spelling) { return spelling == name; })) return exact;
  return find_spelling([&](std::string_view spelling) { return same_but_for_case(name, spelling); });
}

RecordedUnit unit_of(const std::string& where, std::string_view name, Quantity quantity) {
  const auto unit = find_unit(name);
  if (unit && unit->quantity == quantity) return *unit;
  std::vector<std::string> known;
  for (const RecordedUnit& u : kUnits)
    if (u.quantity == quantity) known.emplace_back(u.name);
  if (unit)
    throw Error(fmt::format("{}: {} is a unit of {}, but {} is expected ({})", where, name,
                            tandem::name(unit->quantity), tandem::name(quantity), listed(known, "or")));
  throw Error(fmt::format("{}: unknown unit {}{} (units of {}: {})", where, quote(name),
                          did_you_mean(std::string(name), known), tandem::name(quantity), listed(known)));
}

std::string unit_in_name(std::string_view name) {
  std::string unknown;
  for (const auto& [open, close] : {std::pair{'[', ']'}, {'(', ')'}, {'{', '}'}}) {
    const std::size_t begin = name.find(open), end = name.rfind(close);
    if (begin == std::string_view::npos || end == std::string_view::npos || end < begin) continue;
    const std::string_view text = trimmed(name.substr(begin + 1, end - begin - 1));
    if (parse_number(text)) continue;  // an index
    if (const auto unit = find_unit(text)) return std::string(unit->name);
    if (begin > 0 && end + 1 == name.size() && may_be_unit(text)) unknown = std::string(text);
  }
  if (!unknown.empty()) return unknown;
  // "speed_m_s" before "speed_s"
  for (std::size_t at = name.find('_'); at != std::string_view::npos; at = name.find('_', at + 1)) {
    const std::string_view text = name.substr(at + 1);
    if (const auto unit = find_unit(text); unit && unit->quantity != Quantity::number) return std::string(unit->name);
    if (text.size() > 1 && is_ambiguous(text)) return std::string(text);
  }
  return "";
}

}  // namespace tandem
