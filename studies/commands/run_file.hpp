#pragma once

#include <map>
#include <string>
#include <vector>

#include <tandem/studies/commands/command_options.hpp>

namespace tandem {

/// Run files: YAML with `command:` and one key per option, as --print-config prints it and each output folder has it
/// (run.yaml).
///
///     command: estimate
///     scenario: /data/my_run
///     mode: B
///     noise: ["usbl=2,2,3", "odometry=0.1,0.1,0.1,0.01,0.01,0.01"]   # an option that may be repeated
///     robust: true                                               # a flag

/// Returns the words of a command line with those of the file that --config names in front. A word of the command line
/// replaces the value of the file. A file of tandem tune serves all commands; a warning names options that the command
/// does not have. Throws Error with file and line if the file is for another command or has an unknown key.
std::vector<std::string> with_run_file(const std::string& command, CommandOptions& options,
                                       std::vector<std::string> words);

/// Returns the run file that repeats this run: the given options without --config and the output folder. Relative paths
/// become absolute. Options in `replaced` have these values instead, and are omitted if there are none.
std::string run_file(const std::string& command, const std::string& version, const CommandOptions& options,
                     const std::map<std::string, std::vector<std::string>>& replaced = {});

}  // namespace tandem
