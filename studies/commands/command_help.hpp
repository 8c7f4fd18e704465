#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/commands/command.hpp>

namespace tandem {

/// Returns the help or reference text that a command line requests, or nothing if it requests none:
///   -h, --help         usage and everyday options
///   --help-all         usage and all options
///   --reference FORMAT (not shown in help) all options for documentation: markdown, man, words (option names)
///                      or json
///   --reference files [FILE] (not shown in help) names of the described result files, or the markdown table of FILE
/// Lines are wrapped at the width of the terminal, or at 100 columns.
std::optional<std::string> requested_help(const NamedCommand& command, const CommandOptions& options,
                                          const std::vector<std::string>& words);

}  // namespace tandem
