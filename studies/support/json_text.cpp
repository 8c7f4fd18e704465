#include <cstdint>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/support/json_text.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Returns the text of a JSON value. nlohmann-json escapes only the control characters below 0x20.
std::string dumped(const nlohmann::ordered_json& json, int indent) {
  const std::string text = json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  std::string escaped;
  for (std::size_t at = 0, n = 1; at < text.size(); at += n) {
    const auto first = static_cast<unsigned char>(text[at]);
    n = first < 0xC0 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
    const std::string_view character = std::string_view(text).substr(at, n);
    if (first < 0x7F || printable(character) == character) {
      escaped += character;
      continue;
    }
    std::uint32_t code = n == 1 ? first : first & (0x7Fu >> n);
    for (std::size_t i = 1; i < n; ++i) code = code << 6 | (static_cast<unsigned char>(character[i]) & 0x3Fu);
    escaped += fmt::format("\\u{:04x}", code);  // all unprintable characters are in the first plane
  }
  return escaped + "\n";
}

}  // namespace

std::string json_text(const nlohmann::ordered_json& json) { return dumped(json, 2); }

std::string json_line(const nlohmann::ordered_json& json) { return dumped(json, -1); }

}  // namespace tandem
