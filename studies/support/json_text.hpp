#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace tandem {

/// As it is written to files and terminals; a name may hold bytes that are no UTF-8.
inline std::string json_text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace tandem
