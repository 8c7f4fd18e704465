#pragma once

#include <filesystem>

namespace tandem {

/// An exclusive lock (flock) of a folder or a file, until the destructor or the end of the process.
class FileLock {
 public:
  enum class Busy { wait, give_up };

  /// Locks a folder, or a file, which is created if it is missing. Waits while another process holds the lock, or gives
  /// up.
  FileLock(const std::filesystem::path& path, Busy busy);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

  /// Returns 0 if the lock is held, EWOULDBLOCK if another process holds it, or the errno of the failure.
  int failure() const { return failure_; }

 private:
  int descriptor_, failure_ = 0;
};

}  // namespace tandem
