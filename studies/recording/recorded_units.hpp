#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace tandem {

/// Physical quantity of a unit.
enum class Quantity {
  time,
  length,
  angle,
  speed,
  acceleration,
  angular_rate,
  pressure,
  magnetic_field,
  number,
};
std::string_view name(Quantity quantity);
/// Returns the unit that values are converted to, for example "m/s^2", "rad" or "1".
std::string_view si_unit(Quantity quantity);

/// A unit of a recording: value in SI units and radians = factor · value.
struct RecordedUnit {
  std::string_view name;
  Quantity quantity;
  double factor;
};

/// Returns the unit of this name ("deg", "ms", "mm/s", "bar", "g", "kn", …), or nothing. Names are case-sensitive.
std::optional<RecordedUnit> find_unit(std::string_view name);
/// Returns the unit of this name and quantity. Otherwise throws Error with `where` and the units of the quantity.
RecordedUnit unit_of(const std::string& where, std::string_view name, Quantity quantity);

/// Splits a column name with a unit: "range [m]" → "m", "heading_deg" → "deg". Empty if there is none.
std::string unit_in_name(std::string_view name);

}  // namespace tandem
