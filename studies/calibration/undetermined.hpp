#pragma once

#include <string>

namespace tandem {

/// An error of the solvers about states that the data leave free, "the measurements do not determine target 280 in y"; others
/// as they are.
std::string told_of_states(const std::string& error);

/// The same as a sentence about scenarios, and about options that would help.
std::string told_to_users(const std::string& error, const std::string& scenarios);

}  // namespace tandem
