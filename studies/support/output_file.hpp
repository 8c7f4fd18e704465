#pragma once

#include <filesystem>
#include <fstream>
#include <string_view>

namespace tandem {

/// A file that is written piece by piece, for content too large for memory.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path file);
  void write(std::string_view text);
  /// Closes the file. Throws Error, with the reason of the first failure, if any write failed.
  void close();

 private:
  std::filesystem::path file_;
  std::ofstream stream_;
  int reason_ = 0;  // errno of the first failure
};

/// Writes a whole file. Throws Error if it cannot be written.
void write_file(const std::filesystem::path& file, std::string_view text);
/// Replaces a whole file at once, so that a failure leaves the old content. Throws Error if it cannot be written.
void replace_file(const std::filesystem::path& file, std::string_view text);

}  // namespace tandem
