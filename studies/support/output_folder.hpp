#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace tandem {

/// A folder that receives its files all at once, when they are complete: nobody sees half of them, and
/// nothing is made before there is something to put in it.
class OutputFolder {
 public:
  /// Checks that `folder` can be made or written to, and leaves nothing behind. Throws Error.
  explicit OutputFolder(std::filesystem::path folder);

  /// Lets `write` fill a temporary folder, then moves its files into place. Of what is in the folder already,
  /// the files called `ours` are replaced or, when not written this time, removed; all others stay. Throws
  /// what `write` throws, or Error; then the folder is as it was.
  void fill(const std::vector<std::string>& ours,
            const std::function<void(const std::filesystem::path& temporary)>& write) const;

 private:
  std::filesystem::path folder_;
};

/// Writes a whole file. Throws Error.
void write_file(const std::filesystem::path& file, const std::string& text);

}  // namespace tandem
