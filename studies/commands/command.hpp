#pragma once

#include <functional>
#include <string>

#include <tandem/studies/commands/command_options.hpp>
#include <tandem/studies/support/file_description.hpp>

namespace tandem {

/// Exit statuses of all commands. Status kInvalidInput: invalid input or usage; nothing is written. Status kIncomplete:
/// a solve did not converge, the run was stopped early, or it has no usable result. Partial results are printed and
/// written. Status kMisfit: with --strict, the data do not fit the model. In simulations over random seeds (study,
/// rendezvous), runs that fail are results. Status kIncomplete then means that the run was stopped early or that no
/// trial converged.
constexpr int kSuccess = 0, kInvalidInput = 1, kIncomplete = 2, kMisfit = 3;

/// A command: its options and the function that it runs.
struct Command {
  /// Registers the options and returns the function to run, which returns the exit status and throws Error on wrong
  /// input. The options outlive the run.
  std::function<std::function<int()>(CommandOptions& option)> prepare;
  bool stops = false;  ///< true: an interrupt ends the run early with its best result; false: it ends the process
  /// Describes the result files and the JSON document of --json for docs/file_formats.md. Null if there are none.
  std::function<std::vector<FileDescription>()> files{};
};

/// A command with its name and summary for help texts.
struct NamedCommand {
  std::string name, summary;
  Command command;
};

/// The command that this process runs. TANDEM_COMMAND defines it.
NamedCommand this_command();

/// Defines this_command() from `Command NAME_command()`. Each NAME_command.cpp uses it once. CMake reads this line too:
/// it builds libexec/tandem/tandem-NAME from the file and lists the command under `group` in `tandem --help`.
#define TANDEM_COMMAND(name, group, summary) \
  NamedCommand this_command() { return {#name, summary, name##_command()}; }

/// Parses `tandem NAME …`, runs the command and returns the exit status. Results go to standard output. On invalid
/// input, prints one sentence to standard error and returns kInvalidInput.
int run_command(const NamedCommand& command, int argc, const char* const* argv, const std::string& version);

}  // namespace tandem
