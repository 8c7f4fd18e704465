#pragma once

#include <vector>

#include <nlohmann/json.hpp>

#include <tandem/studies/navigation/found_constants.hpp>

namespace tandem {

inline nlohmann::ordered_json staying_error(const FoundConstant& c) {
  return {{"value", c.value}, {"sigma", c.deviation}, {"given_sigma", c.given}, {"verdict", text(c.verdict())}};
}
/// "staying_errors" of a summary: by name; nothing where there are none.
inline void add_staying_errors(nlohmann::ordered_json& json, const std::vector<FoundConstant>& found) {
  for (const FoundConstant& c : found) json["staying_errors"][c.name] = staying_error(c);
}

}  // namespace tandem
