#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/import/import_map.hpp>

namespace tandem {

bool is_met(const ImportCondition& condition, const RecordedValue& value) {
  using enum ImportCondition::Op;
  const bool as_text = !value.text.empty() || std::isnan(condition.number);
  const double a = value.number, b = condition.number;
  switch (condition.op) {
    case equal:
      return as_text ? value.text == condition.text : a == b;
    case not_equal:
      return as_text ? value.text != condition.text : a != b;
    case less:
      return a < b;
    case less_equal:
      return a <= b;
    case greater:
      return a > b;
    case greater_equal:
      return a >= b;
  }
  return false;
}

std::string condition_text(const ImportCondition& condition) {
  constexpr const char* symbols[] = {"=", "!=", "<", "<=", ">", ">="};
  return fmt::format("{} {} {}", condition.field, symbols[static_cast<int>(condition.op)], condition.text);
}

}  // namespace tandem
