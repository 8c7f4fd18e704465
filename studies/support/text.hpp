#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/solvers/name_suggestions.hpp>  // did_you_mean

namespace tandem {

/// Returns the number if the whole text is one (including ±inf and nan), otherwise nothing.
std::optional<double> parse_number(std::string_view text);

/// Returns the integer if the whole text is one that is above zero and fits an int, otherwise nothing.
std::optional<int> parse_positive_integer(std::string_view text);

/// Returns the text without blanks (space, tab, carriage return) at its ends.
std::string_view trimmed(std::string_view text);

/// Returns the text with the letters A to Z in lower case.
std::string lower_case(std::string_view text);

/// Returns the trimmed parts between separators. Empty parts are kept: "a,,b" has three.
std::vector<std::string_view> split(std::string_view text, char separator);
/// Stores the parts in an existing vector. Avoids allocations for files with many lines.
void split(std::string_view text, char separator, std::vector<std::string_view>& parts);

/// Returns the words of a text, separated by any number of blanks.
std::vector<std::string_view> words(std::string_view text);
/// Stores the words in an existing vector.
void words(std::string_view text, std::vector<std::string_view>& parts);

/// Returns the text with control characters and invalid UTF-8 bytes replaced by \xNN, so that it cannot control a
/// terminal.
std::string printable(std::string_view text);

/// Returns printable() of each line of a text; line ends are kept.
std::string printable_lines(std::string_view text);

/// Returns the text in single quotes, printable and shortened to 40 bytes, for error messages.
std::string quote(std::string_view text);

/// Breaks lines of more than `width` characters at blanks. Continuation lines start with `indent` blanks.
std::string wrapped(std::string_view text, std::size_t width, std::size_t indent = 0);

/// Joins words as prose: "a, b and c", with `last` before the last word.
std::string listed(const std::vector<std::string>& words, std::string_view last = "and");

}  // namespace tandem
