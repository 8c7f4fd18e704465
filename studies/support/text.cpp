#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <cstdlib>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

bool is_continuation(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

/// Returns the number of bytes of the UTF-8 character at the start of `text`. Returns 0 for invalid UTF-8, control
/// characters (C0, DEL, C1), Unicode line separators and characters that change the writing direction.
std::size_t printable_bytes(std::string_view text) {
  const auto first = static_cast<unsigned char>(text.front());
  if (first < 0x80) return first >= 0x20 && first != 0x7F ? 1 : 0;
  const std::size_t n = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < n) return 0;
  std::uint32_t code = first & (0x7Fu >> n);
  for (std::size_t i = 1; i < n; ++i) {
    if (!is_continuation(text[i])) return 0;
    code = code << 6 | (static_cast<unsigned char>(text[i]) & 0x3Fu);
  }
  const bool too_long = (n == 3 && code < 0x800) || (n == 4 && (code < 0x10000 || code > 0x10FFFF));
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  const bool directs =
      (code >= 0x200E && code <= 0x200F) || (code >= 0x2028 && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
  return code < 0xA0 || too_long || surrogate || directs ? 0 : n;
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);  // from_chars rejects a plus sign
  double value = 0.0;
#if defined(__cpp_lib_to_chars)
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return {};
#else  // libc++ before version 20
  if (text.empty() || is_blank(text.front()) || text.find_first_of("xX") != std::string_view::npos) return {};
  const std::string terminated(text);
  char* end = nullptr;
  value = std::strtod(terminated.c_str(), &end);
  if (end != terminated.c_str() + terminated.size()) return {};
#endif
  return value;
}

std::optional<int> parse_positive_integer(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value <= 0) return {};
  return value;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

void split(std::string_view text, char separator, std::vector<std::string_view>& parts) {
  parts.clear();
  while (true) {
    const std::size_t end = text.find(separator);
    parts.push_back(trimmed(text.substr(0, end)));
    if (end == std::string_view::npos) return;
    text.remove_prefix(end + 1);
  }
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  split(text, separator, parts);
  return parts;
}

void words(std::string_view text, std::vector<std::string_view>& parts) {
  parts.clear();
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    const auto end = std::find_if(text.begin(), text.end(), is_blank);
    parts.emplace_back(text.begin(), end);
    text.remove_prefix(parts.back().size());
  }
}

std::vector<std::string_view> words(std::string_view text) {
  std::vector<std::string_view> parts;
  words(text, parts);
  return parts;
}

std::string printable(std::string_view text) {
  std::string shown;
  while (!text.empty()) {
    const std::size_t n = printable_bytes(text);
    if (n > 0)
      shown += text.substr(0, n);
    else
      shown += fmt::format("\\x{:02x}", static_cast<unsigned char>(text.front()));
    text.remove_prefix(std::max<std::size_t>(n, 1));
  }
  return shown;
}

std::string printable_lines(std::string_view text) {
  std::string shown;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = std::min(text.find('\n', from), text.size());
    shown += printable(text.substr(from, end - from));
    if (end < text.size()) shown += '\n';
    from = end + 1;
  }
  return shown;
}

std::string quote(std::string_view text) {
  constexpr std::size_t longest = 40;
  std::size_t end = std::min(text.size(), longest);
  while (end > 0 && end < text.size() && is_continuation(text[end])) --end;  // cuts between characters
  return "'" + printable(text.substr(0, end)) + (end < text.size() ? "…'" : "'");
}

std::string wrapped(std::string_view text, std::size_t width, std::size_t indent) {
  std::string result;
  std::size_t column = 0;                 // characters in the current line
  std::size_t blank = std::string::npos;  // last blank of the current line, as an index of `result`
  for (const char c : text) {
    if (c == '\n') {
      column = 0;
      blank = std::string::npos;
    } else if (!is_continuation(c)) {
      ++column;
    }
    if (c == ' ' && column > indent + 1) blank = result.size();
    result += c;
    if (column <= width || blank == std::string::npos) continue;
    result.replace(blank, 1, "\n" + std::string(indent, ' '));
    column = indent;
    for (std::size_t i = blank + 1 + indent; i < result.size(); ++i) column += is_continuation(result[i]) ? 0 : 1;
    blank = std::string::npos;
  }
  return result;
}

std::string listed(const std::vector<std::string>& words, std::string_view last) {
  if (words.size() < 2) return words.empty() ? "" : words.front();
  return fmt::format("{} {} {}", fmt::join(words.begin(), words.end() - 1, ", "), last, words.back());
}

}  // namespace tandem
