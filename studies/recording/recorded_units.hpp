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

/// Returns the unit of this name ("deg", "ms", "mm/s", "bar", "g", "kn", …), or nothing. The case matters only where it
/// distinguishes units: "Knots" is kn, but "Mm" is not mm.
std::optional<RecordedUnit> find_unit(std::string_view name);
/// Returns the unit of this name and quantity. Otherwise throws Error with `where` and the units of the quantity.
RecordedUnit unit_of(const std::string& where, std::string_view name, Quantity quantity);

/// Returns the unit in a column name: "range [m]" → "m", "heading_deg" → "deg". A text in brackets that is no known unit
/// is returned as it is: "depth [cubits]" → "cubits". Empty if there is none.
std::string unit_in_name(std::string_view name);

}  // namespace tandem
