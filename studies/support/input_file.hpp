#pragma once

#include <filesystem>
#include <istream>
#include <streambuf>
#include <string>
#include <vector>

namespace tandem {

/// A regular file that is read as a stream. A failed read throws Error, unlike in std::ifstream.
class InputFile : public std::istream {
 public:
  /// Opens the file. Throws Error if it is missing, unreadable, a folder, a pipe or a device, and if it is in the
  /// output folder of this process; see refuse_inputs_in().
  explicit InputFile(std::filesystem::path file);

 private:
  /// A buffered file descriptor, which supports seeking.
  class Buffer : public std::streambuf {
   public:
    explicit Buffer(std::filesystem::path file);
    ~Buffer() override;

   protected:
    int_type underflow() override;
    pos_type seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode mode) override;
    pos_type seekpos(pos_type position, std::ios::openmode mode) override;

   private:
    std::filesystem::path file_;
    int descriptor_;
    std::vector<char> bytes_;
  };

  Buffer buffer_;
};

/// Returns the content of a file. Throws Error like InputFile does.
std::string read_text(const std::filesystem::path& file);
/// Returns the content of a file that Tandem maintains itself, such as a snapshot. It may be in the output folder.
std::string read_state(const std::filesystem::path& file);

/// Makes it an error to read an input in this folder: the results that the process writes to it would replace or
/// surround its own inputs. An empty path, the default, allows all folders.
void refuse_inputs_in(const std::filesystem::path& output_folder);

/// Sets whether the files of a folder may be outside that folder. The default is false.
void allow_outside_files(bool allowed);
/// Returns whether the path `name`, relative to `folder`, leads out of the folder, directly or by symbolic links.
/// Returns false after allow_outside_files(true).
bool leads_outside(const std::filesystem::path& folder, const std::filesystem::path& name);
/// Returns the path of the file `name` of a folder. Throws Error if it leads out of the folder.
std::filesystem::path file_in(const std::filesystem::path& folder, const std::filesystem::path& name);

}  // namespace tandem
