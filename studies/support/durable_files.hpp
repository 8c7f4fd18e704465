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

/// Files that are to survive a kill or a power failure while the program goes on: a thread of its own writes what has come
/// and has the system put it on the disk, so that neither a slow disk nor a silent input delays the other.
class DurableFiles {
 public:
  /// What has come is on the disk after `period`, but for the time that the disk takes.
  explicit DurableFiles(std::chrono::milliseconds period);
  /// Writes what is left.
  ~DurableFiles();
  DurableFiles(const DurableFiles&) = delete;

  /// A file to append to, of which the first `keep` bytes stay, where it is there. Returns what append() calls it. Throws
  /// Error.
  std::size_t open(const std::filesystem::path& file, std::uintmax_t keep = 0);
  void append(std::size_t file, std::string_view text);
  /// Bytes of a file, all that was appended counted.
  std::uintmax_t size(std::size_t file) const;
  /// A whole file in place of the old one by one rename, after all that was appended before is on the disk.
  void replace(const std::filesystem::path& file, std::string text);
  /// Waits until all that has come was written, or has failed.
  void flush();

  /// Why something could not be written, a sentence; empty where all could, or nothing has failed since it was asked last.
  /// What was not written is tried again, as long as that is not too much to be kept.
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
  bool ends_ = false, hurries_ = false, busy_ = false;
  std::thread thread_;
};

/// Cuts a file behind its last line end, where a kill has left half a line. Throws Error.
void cut_half_line(const std::filesystem::path& file);

}  // namespace tandem
