#include <algorithm>
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
    {"m", Quantity::length, 1},
    {"cm", Quantity::length, 1e-2},
    {"mm", Quantity::length, 1e-3},
    {"km", Quantity::length, 1e3},
    {"ft", Quantity::length, kFoot},
    {"nmi", Quantity::length, 1852},
    {"rad", Quantity::angle, 1},
    {"deg", Quantity::angle, kDegree},
    {"cdeg", Quantity::angle, kDegree * 1e-2},
    {"1e-7deg", Quantity::angle, kDegree * 1e-7},
    {"mrad", Quantity::angle, 1e-3},
    {"gon", Quantity::angle, std::numbers::pi / 200},
    {"ddmm", Quantity::angle, 0},  // degrees and minutes, as in NMEA; see import_values.cpp
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
    {"mGauss", Quantity::magnetic_field, 1e-7},
    {"1", Quantity::number, 1},
    {"%", Quantity::number, 1e-2},
};

/// Other spellings of units in column names.
constexpr std::pair<std::string_view, std::string_view> kSpellings[] = {
    {"degrees", "deg"}, {"degree", "deg"},  {"°", "deg"},          {"seconds", "s"},       {"sec", "s"},
    {"secs", "s"},      {"msec", "ms"},     {"usec", "us"},        {"µs", "us"},           {"nsec", "ns"},
    {"nanosec", "ns"},  {"metres", "m"},    {"meters", "m"},       {"knots", "kn"},        {"kts", "kn"},
    {"kt", "kn"},       {"mps", "m/s"},     {"m_s", "m/s"},        {"kmh", "km/h"},        {"kph", "km/h"},
    {"radians", "rad"}, {"pa", "Pa"},       {"kpa", "kPa"},        {"hpa", "hPa"},         {"m/s/s", "m/s^2"},
    {"m/s²", "m/s^2"},  {"m/s2", "m/s^2"},  {"rads", "rad/s"},     {"dps", "deg/s"},       {"°/s", "deg/s"},
    {"degps", "deg/s"}, {"deg_s", "deg/s"}, {"rad_s", "rad/s"},    {"mm_s", "mm/s"},       {"cm_s", "cm/s"},
    {"m_s2", "m/s^2"},  {"radps", "rad/s"}, {"degheading", "deg"}, {"deglatitude", "deg"}, {"deglongitude", "deg"}};

std::string_view canonical(std::string_view name) {
  for (const auto& [spelling, unit] : kSpellings)
    if (spelling == name) return unit;
  return name;
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
  const std::string_view wanted = canonical(name);
  for (const RecordedUnit& unit : kUnits)
    if (unit.name == wanted) return unit;
  return {};
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
  for (const auto& [open, close] : {std::pair{'[', ']'}, {'(', ')'}, {'{', '}'}}) {
    const std::size_t begin = name.find(open), end = name.rfind(close);
    if (begin == std::string_view::npos || end == std::string_view::npos || end < begin) continue;
    if (const auto unit = find_unit(trimmed(name.substr(begin + 1, end - begin - 1)))) return std::string(unit->name);
  }
  // "speed_m_s" before "speed_s"
  for (std::size_t at = name.find('_'); at != std::string_view::npos; at = name.find('_', at + 1))
    if (const auto unit = find_unit(name.substr(at + 1)); unit && unit->quantity != Quantity::number)
      return std::string(unit->name);
  return "";
}

}  // namespace tandem
