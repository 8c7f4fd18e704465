#pragma once

#include <atomic>
#include <string_view>

namespace tandem {

/// Returns the flag that SIGINT (Ctrl-C) and SIGTERM set after stop_on_interrupt().
const std::atomic<bool>& interrupted();

/// Makes the next SIGINT or SIGTERM set interrupted(). A second signal of the same kind ends the program.
void stop_on_interrupt();

/// Prints "tandem: SENTENCE" to standard error with control characters escaped; see printable().
void warn(std::string_view sentence);

/// Redirects standard output to standard error for its lifetime, so that output of libraries does not mix with results.
class StdoutToStderr {
 public:
  StdoutToStderr();
  ~StdoutToStderr();
  StdoutToStderr(const StdoutToStderr&) = delete;
  StdoutToStderr& operator=(const StdoutToStderr&) = delete;

 private:
  int output_;
};

}  // namespace tandem
