#pragma once

#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

namespace tandem {

/// Sets the text of run.yaml, the run file that OutputFolder::fill() adds to every output folder of this process. Empty
/// (the default): none.
void set_run_file(std::string text);

/// An output folder that receives all files of a run at once. Readers see either the files of the previous run or the
/// complete files of the new one.
class OutputFolder {
 public:
  /// Name of the file that lists the files of the last run, one name a line. fill() writes it.
  static constexpr const char* manifest = ".tandem-files";

  /// Checks that `folder` exists or can be created, and is writable. Creates nothing. Throws Error.
  explicit OutputFolder(std::filesystem::path folder);

  /// Lets fill() overwrite files that Tandem did not write, and allows inputs in the folder.
  void force() { forced_ = true; }

  /// Throws Error if the folder has files of these names that Tandem did not write, or a scenario that Tandem wrote and
  /// that the run would remove. Makes it an error to read an input in the folder. Commands call it before they read
  /// their inputs, fill() checks again.
  void check(const std::vector<std::string>& names) const;

  /// Calls `write` with a temporary folder, then moves its files into the output folder. Replaces files of the last
  /// run, removes those that were not written again, and keeps all other files. Throws Error like check(), or what
  /// `write` throws; the output folder is then unchanged.
  void fill(const std::function<void(const std::filesystem::path& temporary)>& write) const;

  /// Returns the folder for partial results of a run: DIR.partial beside the output folder. If its parent is not
  /// writable or is on another file system, returns DIR/partial. Creates nothing.
  std::filesystem::path partial() const;

 private:
  void check_overwritable(const std::set<std::string>& names) const;

  std::filesystem::path folder_;
  bool forced_ = false;
};

}  // namespace tandem
