#pragma once

#include <string>

namespace tandem {

/// Returns the text with the special characters of HTML as entities, also for attributes in double quotes.
inline std::string html_escaped(const std::string& text) {
  std::string result;
  for (const char c : text)
    result += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : c == '"' ? "&quot;" : std::string(1, c);
  return result;
}

}  // namespace tandem
