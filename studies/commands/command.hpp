#pragma once

#include <functional>
#include <string>
#include <vector>

#include <tandem/studies/commands/command_options.hpp>

namespace tandem {

/// Exit statuses.
constexpr int kDone = 0, kWrongInput = 1, kNotDone = 2;

/// What a command does.
struct Command {
  /// Registers the options and gives what is then run, which returns the exit status or throws Error on wrong input. The
  /// options live until it has run.
  std::function<std::function<int()>(CommandOptions& option)> prepare;
  bool stops = false;  ///< an interrupt ends it with what it has by then; otherwise it ends the program
};

/// A command as `tandem --help` lists it.
struct ListedCommand {
  std::string name, summary;
  Command command;      ///< of this program
  std::string program;  ///< or of another, which it is handed over to (hand_over())
};

/// Reads a command line, runs the command that it names and returns the exit status. Results go to standard output; what is
/// wrong to standard error, as one sentence, and the status is kWrongInput.
int run_commands(const std::vector<ListedCommand>& commands, int argc, const char* const* argv,
                 const std::string& version);

}  // namespace tandem
