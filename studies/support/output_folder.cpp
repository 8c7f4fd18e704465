#include <cerrno>
#include <cstring>
#include <fstream>

#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/output_folder.hpp>

namespace tandem {
namespace {

/// Removes the folder it made, if it is still there, whatever happens.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(std::filesystem::path path) : path_(std::move(path)) {
    std::filesystem::remove_all(path_);  // of an ended process with the same id
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

void move_into(const std::filesystem::path& from, const std::filesystem::path& to,
               const std::vector<std::string>& ours) {
  for (const std::string& name : ours) {
    if (std::filesystem::exists(from / name))
      std::filesystem::rename(from / name, to / name);
    else
      std::filesystem::remove(to / name);
  }
}

}  // namespace

OutputFolder::OutputFolder(std::filesystem::path folder) {
  if (folder.empty()) throw Error("--out needs the name of a folder");
  folder_ = std::filesystem::absolute(folder).lexically_normal();
  if (!folder_.has_filename()) folder_ = folder_.parent_path();  // "DIR/"
  std::filesystem::path existing = folder_;
  while (!std::filesystem::exists(existing)) existing = existing.parent_path();
  if (!std::filesystem::is_directory(existing))
    throw Error(fmt::format("--out {}: {} is not a folder", folder.string(), existing.string()));
  std::string probe = (existing / ".tandem-XXXXXX").string();  // permissions alone do not tell
  if (!mkdtemp(probe.data()))
    throw Error(
        fmt::format("--out {}: {} cannot be written to: {}", folder.string(), existing.string(), std::strerror(errno)));
  std::filesystem::remove(probe);
}

void OutputFolder::fill(const std::vector<std::string>& ours,
                        const std::function<void(const std::filesystem::path&)>& write) const try {
  // Beside the folder or, when that exists and may be on another file system than its parent, inside it.
  const bool exists = std::filesystem::exists(folder_);
  const std::string name = fmt::format(".{}.tandem-{}", folder_.filename().string(), getpid());
  const TemporaryFolder temporary((exists ? folder_ : folder_.parent_path()) / name);
  write(temporary.path());
  if (exists)
    move_into(temporary.path(), folder_, ours);
  else
    std::filesystem::rename(temporary.path(), folder_);
} catch (const std::filesystem::filesystem_error& error) {
  throw Error(fmt::format("--out {}: {}", folder_.string(), error.code().message()));
}

void write_file(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) throw Error(fmt::format("{} cannot be written", file.string()));
}

}  // namespace tandem
