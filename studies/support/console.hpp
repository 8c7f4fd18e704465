#pragma once

#include <atomic>

namespace tandem {

/// Set by an interrupt (Ctrl-C) after stop_on_interrupt().
const std::atomic<bool>& interrupted();

/// The next interrupt sets interrupted(); the one after it ends the program.
void stop_on_interrupt();

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
