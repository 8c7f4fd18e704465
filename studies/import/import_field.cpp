#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/import/import_field.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Returns the unit that the recording states for a field, or an empty text. Throws Error if it is not one of the
/// quantity. Units of times may be unknown, since columns are called "time (UTC)".
std::string stated_unit(const std::string& where, const RecordedField& field, Quantity quantity) {
  if (field.unit.empty() || quantity == Quantity::number) return "";
  const auto stated = find_unit(field.unit);
  if (!stated && quantity == Quantity::time) return "";
  if (!stated)
    throw Error(
        fmt::format("{}: {} states {}, which is ambiguous or unknown as a unit; write \"{} [UNIT]\", for example "
                    "[{}]",
                    where, field.name, quote(field.unit), field.name, si_unit(quantity)));
  if (stated->quantity != quantity)
    throw Error(
        fmt::format("{}: {} is in {} by its name or source, but {} is expected; write \"{} [UNIT]\" to state "
                    "the unit",
                    where, field.name, field.unit, name(quantity), field.name));
  return field.unit;
}

}  // namespace

ImportField import_field(const RecordedStream& stream, const std::string& where, std::string_view text,
                         Quantity quantity) {
  ImportField result;
  std::string expression(trimmed(text));
  if (expression.starts_with('=')) {
    const auto number = parse_number(trimmed(std::string_view(expression).substr(1)));
    if (!number) throw Error(fmt::format("{}: {} is not a constant; write =NUMBER", where, quote(expression)));
    result.constant = *number;
    return result;
  }
  const RecordedField* found = find_field(stream, expression);
  double sign = 1;
  if (!found && expression.starts_with('-')) {
    sign = -1;
    expression = std::string(trimmed(std::string_view(expression).substr(1)));
    found = find_field(stream, expression);
  }
  std::string unit;
  if (!found && expression.ends_with(']')) {
    const std::size_t open = expression.rfind('[');
    if (open != std::string::npos && open > 0) {
      unit = std::string(trimmed(std::string_view(expression).substr(open + 1, expression.size() - open - 2)));
      expression = std::string(trimmed(std::string_view(expression).substr(0, open)));
      found = find_field(stream, expression);
    }
  }
  if (!found && expression == kReceiveTime) {
    result.field = expression;
    return result;
  }
  if (!found) throw Error(fmt::format("{}: {}", where, unknown_field(stream, expression)));
  result.field = expression.find('[') != std::string::npos ? expression : found->name;
  if (unit.empty()) unit = stated_unit(where, *found, quantity);
  if (!unit.empty()) {
    const RecordedUnit known = unit_of(where, unit, quantity);
    result.unit = std::string(known.name);
    result.degrees_and_minutes = known.name == "ddmm";
    result.time_of_day = known.name == "hhmmss";
    result.factor = result.degrees_and_minutes ? std::acos(-1.0) / 180 : result.time_of_day ? 1 : known.factor;
  }
  result.factor *= sign;
  return result;
}

}  // namespace tandem
