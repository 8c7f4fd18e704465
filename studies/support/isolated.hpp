#pragma once

#include <atomic>
#include <functional>
#include <string>

namespace tandem {

/// What a function did in a process of its own.
struct IsolatedRun {
  std::string result;      ///< what it returned
  std::string failure;     ///< why there is no result, a sentence; else empty
  double peak_memory = 0;  ///< bytes: the largest resident set of the process, program and inherited data included
};

/// Runs `work` in a forked process, so that its memory is its own and its crash is no one else's, and waits for it. After
/// `seconds` it is killed. `stop` is passed on to it as an interrupt, after which it has five seconds to end. What it
/// prints goes to standard error. The calling process must have one thread only: no oneTBB, no solve before.
IsolatedRun run_isolated(const std::function<std::string()>& work, double seconds, const std::atomic<bool>& stop);

}  // namespace tandem
