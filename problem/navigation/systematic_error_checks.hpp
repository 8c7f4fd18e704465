#pragma once

#include <string>

#include <tandem/problem/navigation/systematic_error.hpp>

namespace tandem {

/// Returns why the values are invalid, or an empty string. Standard deviations of the bias must be positive and
/// finite. Standard deviations of constants must be zero or positive, and finite. For the delay, the maximum is 60 s.
/// The correlation time must be positive or infinite.
std::string why_invalid(const SystematicError& error);

}  // namespace tandem
