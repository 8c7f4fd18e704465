#pragma once

#include <string>

#include <tandem/problem/navigation/staying_error.hpp>

namespace tandem {

/// Empty, or what is wrong with its values: each standard deviation must be finite and above zero, or zero for a constant
/// that there is not; the time above zero, infinite at most.
std::string why_invalid(const StayingError& error);

}  // namespace tandem
