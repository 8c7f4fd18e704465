#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include <tandem/studies/support/input_file.hpp>

namespace tandem {

/// A file that is read by position, with little memory.
class FileBytes {
 public:
  /// Throws Error if the file cannot be read.
  explicit FileBytes(const std::filesystem::path& file);

  std::uint64_t size() const { return size_; }
  /// Returns n bytes from a position, valid until the next call. Throws OutOfBytes if the file ends before.
  std::string_view read(std::uint64_t position, std::uint64_t n);
  /// Returns the bytes from a position up to n bytes after it or to the end of the file.
  std::string_view read_at_most(std::uint64_t position, std::uint64_t n) {
    return read(position, position > size_ ? 0 : std::min(n, size_ - position));
  }

 private:
  InputFile stream_;
  std::uint64_t size_ = 0, at_ = 0;
  std::string buffer_;
};

}  // namespace tandem
