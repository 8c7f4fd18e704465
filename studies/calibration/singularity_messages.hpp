#pragma once

#include <string>

#include <tandem/lie/error.hpp>

namespace tandem {

/// Returns "the measurements do not determine target 280 in y" for the unobservable states "target 280 in y".
std::string undetermined(const std::string& states);

/// Returns this sentence if the error is a NotObservableError, else its message.
std::string explain_singularity(const Error& error);

/// Returns this sentence with the names of the scenarios and the options that may help.
std::string with_remedies(const NotObservableError& error, const std::string& scenarios);

}  // namespace tandem
