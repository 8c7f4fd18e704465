#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace tandem {

/// Files that are written while the program runs and survive a kill or a power failure. A background thread writes and
/// flushes the text to the disk, so that a slow disk does not delay the callers.
class DurableFiles {
 public:
  /// Starts the writer thread. Text reaches the disk `period` after append(), plus the time of the disk operations.
  explicit DurableFiles(std::chrono::milliseconds period);
  /// Writes the pending text and stops the thread.
  ~DurableFiles();
  DurableFiles(const DurableFiles&) = delete;

  /// Opens or creates a file to append to, truncated to its first `keep` bytes. Returns its handle for append() and
  /// size(). Throws Error if the file cannot be opened.
  std::size_t open(const std::filesystem::path& file, std::uintmax_t keep = 0);
  void append(std::size_t file, std::string_view text);
  /// Returns the size of a file in bytes, including pending text.
  std::uintmax_t size(std::size_t file) const;
  /// Replaces a whole file by one rename, after all text that was appended before is on the disk.
  void replace(const std::filesystem::path& file, std::string text);
  /// Blocks until all pending text is written or has failed.
  void flush();

  /// Returns one sentence about the last failed write since the previous call, or an empty string. Failed writes are
  /// retried; more than 64 MiB of pending text of one file is discarded.
  std::string failure();

 private:
  struct File {
    std::filesystem::path path;
    int descriptor;
    std::uintmax_t written;  // bytes
    std::string pending;
  };

  void run();
  void write_all(std::unique_lock<std::mutex>& lock);

  const std::chrono::milliseconds period_;
  mutable std::mutex mutex_;
  std::condition_variable wake_, written_;
  std::vector<File> files_;
  std::map<std::filesystem::path, std::string> replacements_;
  std::string failure_;
  bool stopping_ = false, flush_requested_ = false, busy_ = false;
  std::thread thread_;
};

/// Truncates a file after its last line end. Removes the incomplete line that a killed writer leaves. Throws Error if
/// the file cannot be read.
void remove_partial_line(const std::filesystem::path& file);

}  // namespace tandem
