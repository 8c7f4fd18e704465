#pragma once

#include <atomic>
#include <string>
#include <string_view>

namespace tandem {

/// Returns the flag that SIGINT (Ctrl-C) and SIGTERM set after stop_on_interrupt().
const std::atomic<bool>& interrupted();

/// Makes the next SIGINT or SIGTERM set interrupted(). A second signal of the same kind ends the program.
void stop_on_interrupt();

/// Opens the null device in place of closed standard streams, so that no other file gets their descriptors, and makes
/// a write to a closed pipe fail instead of ending the process. Programs call it first.
void prepare_standard_streams();

/// Prints to standard output. The first failure is kept for flush_output(); the program continues.
void print(std::string_view text);
/// Writes buffered text to standard output. Returns 0, or the errno of the first failure of print() or of this function
/// in this process.
int flush_output();
/// Returns "cannot write to standard output: REASON" if flush_output() fails, or an empty string.
std::string output_failure();

/// Prints to standard error. Failures are ignored, since nothing else can report them.
void print_error(std::string_view text);
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
