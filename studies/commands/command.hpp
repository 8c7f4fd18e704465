#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <tandem/studies/commands/command_options.hpp>

namespace tandem {

/// Exit statuses.
constexpr int kDone = 0, kWrongInput = 1, kNotDone = 2;

/// One of the program's commands.
struct Command {
  std::string name, summary;  ///< as `tandem --help` lists them
  /// Registers the options and gives what is then run, which returns the exit status or throws Error on wrong input. The
  /// options live until it has run.
  std::function<std::function<int()>(CommandOptions& option)> prepare;
  bool stops = false;  ///< an interrupt ends it with what it has by then; otherwise it ends the program
};

/// Reads a command line, runs the command that it names and returns the exit status. What is wrong goes to standard error
/// as one sentence, and the status is kWrongInput.
int run_commands(const std::vector<Command>& commands, int argc, const char* const* argv, const std::string& version);

}  // namespace tandem
