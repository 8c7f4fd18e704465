#include <algorithm>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/named_parameter.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem::detail {

double number_within(const std::string& where, const std::string& text, double least, double most) {
  const double number = parse_finite(where, text);
  if (number < least || number > most)
    throw Error(fmt::format("{} takes a number from {:g} to {:g}, not {}", where, least, most, text));
  return number;
}

std::string number_text(double value) { return fmt::format("{}", value); }

bool switch_of(const std::string& where, const std::string& text) {
  if (text != "0" && text != "1") throw Error(fmt::format("{} takes 0 or 1, not {}", where, quote(text)));
  return text == "1";
}

std::size_t one_of(const std::string& where, const std::string& text, const std::vector<std::string>& words) {
  const auto found = std::find(words.begin(), words.end(), text);
  if (found == words.end())
    throw Error(
        fmt::format("{} takes {}, not {}{}", where, listed(words, "or"), quote(text), did_you_mean(text, words)));
  return static_cast<std::size_t>(found - words.begin());
}

std::string parameter_line(const std::string& name, const std::string& unit, const std::string& doc,
                           const std::string& default_value) {
  const std::string line = fmt::format("  {:<20} {}{} (default {})", name, doc,
                                       unit.empty() ? "" : fmt::format(" [{}]", unit), default_value);
  return "\n" + wrapped(line, 118, 23);
}

void no_such_parameter(const std::string& where, const std::string& name, const std::vector<std::string>& names) {
  throw Error(fmt::format("{}: unknown parameter {}{}", where, quote(name), did_you_mean(name, names)));
}

}  // namespace tandem::detail
