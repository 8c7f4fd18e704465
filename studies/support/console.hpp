#pragma once

#include <atomic>
#include <string_view>

namespace tandem {

/// Set by an interrupt (Ctrl-C), or a request to terminate, after stop_on_interrupt().
const std::atomic<bool>& interrupted();

/// The next interrupt, or request to terminate, sets interrupted(); the one after it ends the program.
void stop_on_interrupt();

/// Prints "tandem: SENTENCE" to standard error, what a terminal would obey escaped.
void complain(std::string_view sentence);

/// While it lives, what libraries print goes to standard error: standard output is for results.
class LibrariesPrintToStderr {
 public:
  LibrariesPrintToStderr();
  ~LibrariesPrintToStderr();
  LibrariesPrintToStderr(const LibrariesPrintToStderr&) = delete;
  LibrariesPrintToStderr& operator=(const LibrariesPrintToStderr&) = delete;

 private:
  int output_;
};

}  // namespace tandem
