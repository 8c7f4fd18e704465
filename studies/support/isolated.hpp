#pragma once

#include <atomic>
#include <string>
#include <vector>

namespace tandem {

/// What a program did in a process of its own.
struct IsolatedRun {
  std::string output;      ///< what it printed to standard output
  std::string failure;     ///< why that is not a result, a sentence; else empty
  bool stopped = false;    ///< it failed since it was told to stop
  double peak_memory = 0;  ///< bytes: the largest resident set of the process
};

/// Runs a program, so that its memory is its own and its crash is no one else's, and waits for it. After `seconds` it is
/// killed. It is told of `stop` by SIGTERM, after which it has a second to end; an interrupt from the terminal, which
/// reaches the caller too, it does not hear. Its standard error is the caller's. `program` is a path; the first argument
/// is the program's name. Throws Error when no process can be started. The caller may have any number of threads.
IsolatedRun run_isolated(const std::string& program, std::vector<std::string> arguments, double seconds,
                         const std::atomic<bool>& stop);

/// This program's own executable, as run_isolated() takes it.
inline const char* const kThisProgram = "/proc/self/exe";

}  // namespace tandem
