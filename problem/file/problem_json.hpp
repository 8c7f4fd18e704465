#pragma once

#include <string>

#include <tandem/problem/problem_data.hpp>

namespace tandem::detail {

/// Convert the content of a problem to and from JSON text, with one variable or block per line. Both throw Error.
std::string json_text(const ProblemData& data);
ProblemData parse_json(const std::string& text);

}  // namespace tandem::detail
