#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace tandem {

/// A folder that receives its files all at once, when they are complete: nobody sees half of them, and
/// nothing is made before there is something to put in it.
class OutputFolder {
 public:
  /// Names, one a line, of what the last run put into a folder: what a run removes when it does not write it again. It is
  /// written with the rest.
  static constexpr const char* manifest = ".tandem-files";

  /// Checks that `folder` can be made or written to, and leaves nothing behind. Throws Error.
  explicit OutputFolder(std::filesystem::path folder);

  /// Lets `write` fill a temporary folder, then moves all files that are in it into place. Of what is in the folder
  /// already, files of the same names are replaced, those that the last run wrote and this one did not are removed, and
  /// all others stay. Throws what `write` throws, or Error; then the folder is as it was.
  void fill(const std::function<void(const std::filesystem::path& temporary)>& write) const;

  /// Where a run may keep what it has found so far, until it can fill the folder: DIR.partial beside it; DIR/partial where
  /// nothing can be made beside it, or that is another disk. Nothing is made.
  std::filesystem::path partial() const;

 private:
  std::filesystem::path folder_;
};

}  // namespace tandem
