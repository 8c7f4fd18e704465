#pragma once

#include <string>
#include <string_view>

#include <tandem/studies/import/import_map.hpp>

namespace tandem {

/// Returns the field of an expression "[-]NAME [UNIT]" or "=CONSTANT". `where` begins the messages: "map.yaml:3: fields".
/// Throws Error if the stream lacks the field, or if its unit is unknown or not one of the quantity.
ImportField import_field(const RecordedStream& stream, const std::string& where, std::string_view text,
                         Quantity quantity);

}  // namespace tandem
