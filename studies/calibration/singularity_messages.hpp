#pragma once

#include <string>

namespace tandem {

/// Rewrites a solver error about unobservable states as "the measurements do not determine target 280 in y". Returns
/// other errors unchanged. Recognises the messages of Marginals and observability.
std::string explain_singularity(const std::string& error);

/// Does the same, and adds the names of the scenarios and options that may help.
std::string with_remedies(const std::string& error, const std::string& scenarios);

}  // namespace tandem
