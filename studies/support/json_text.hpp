#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace tandem {

/// Returns the text of a JSON value as Tandem writes it: indented, with a final line end, and with invalid UTF-8 bytes
/// replaced. Escapes the characters that printable() escapes, since the text may go to a terminal.
std::string json_text(const nlohmann::ordered_json& json);
/// Returns the text in a single line.
std::string json_line(const nlohmann::ordered_json& json);

}  // namespace tandem
