#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/solvers/near_names.hpp>  // did_you_mean

namespace tandem {

/// The number that `text` is, all of it, ±inf and nan included; nothing when it is none.
std::optional<double> parse_number(std::string_view text);

/// The whole number above zero that `text` is; nothing when it is none.
std::optional<int> whole_number(std::string_view text);

std::string_view trimmed(std::string_view text);

/// The parts between separators, blanks around them removed. "a,,b" has three.
std::vector<std::string_view> split(std::string_view text, char separator);
/// The same into a vector that is there, whose memory is used again: for files of many lines.
void split(std::string_view text, char separator, std::vector<std::string_view>& parts);

/// The parts between any number of blanks.
std::vector<std::string_view> words(std::string_view text);
void words(std::string_view text, std::vector<std::string_view>& parts);

/// What a terminal shows rather than obeys: control characters, and bytes that are no UTF-8, as \xNN.
std::string printable(std::string_view text);

/// The same of several lines, whose ends stay.
std::string printable_lines(std::string_view text);

/// 'text', short and printable, for an error message about a file that may hold anything.
std::string quote(std::string_view text);

/// "a, b and c" (or with another last word).
std::string listed(const std::vector<std::string>& words, std::string_view last = "and");

}  // namespace tandem
