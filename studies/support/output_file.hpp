#pragma once

#include <filesystem>
#include <fstream>
#include <string_view>

namespace tandem {

/// A file that is written piece by piece, for what is too long to be held in memory.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path file);
  void write(std::string_view text);
  /// Throws Error where not all of it could be written.
  void close();

 private:
  std::filesystem::path file_;
  std::ofstream stream_;
  int reason_ = 0;  // errno of the first failure
};

/// Writes a whole file. Throws Error.
void write_file(const std::filesystem::path& file, std::string_view text);

}  // namespace tandem
