#pragma once

#include <string>

#include <tandem/problem/problem_data.hpp>

namespace tandem::detail {

/// A problem's numbers and names as JSON, one variable or block a line, and back. Both throw Error.
std::string json_text(const ProblemData& data);
ProblemData parse_json(const std::string& text);

}  // namespace tandem::detail
