#pragma once

#include <atomic>
#include <filesystem>
#include <string>
#include <vector>

#include <unistd.h>

namespace tandem {

/// The outcome of a program that run_subprocess() ran.
struct SubprocessRun {
  std::string output;      ///< its standard output; empty after a failure
  std::string failure;     ///< reason of the failure; empty on success
  bool stopped = false;    ///< true if it failed after `stop` was set
  double peak_memory = 0;  ///< largest resident set size [bytes]
};

/// Runs a program in a separate process, and waits for it. A crash of the process does not affect the caller, and its
/// peak memory is measured separately. The process is killed after `seconds`. When `stop` is set, it gets SIGTERM and
/// has one second to end. It ignores SIGINT, which a terminal sends to both processes. Its standard input is empty, and
/// its standard error goes to the descriptor `errors`.
///
/// `program` is a path; the first of `arguments` is the program name. Throws Error if no process can be started. The
/// caller may have several threads.
SubprocessRun run_subprocess(const std::string& program, std::vector<std::string> arguments, double seconds,
                             const std::atomic<bool>& stop, int errors = STDERR_FILENO);

/// Returns the path of a program in a folder of PATH, or an empty path.
std::filesystem::path find_program(const std::string& name);

}  // namespace tandem
