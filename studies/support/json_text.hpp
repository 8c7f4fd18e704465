#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace tandem {

/// Returns the text of a JSON value as Tandem writes it: indented, with a final line end, and with invalid UTF-8 bytes
/// replaced.
inline std::string json_text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace tandem
