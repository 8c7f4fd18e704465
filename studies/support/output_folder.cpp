#include <cerrno>
#include <cstring>
#include <fstream>
#include <set>
#include <vector>

#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/output_file.hpp>
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

/// Files that were moved, and move back unless all of them are.
class Moves {
 public:
  Moves() = default;
  ~Moves() {
    std::error_code ignored;
    for (auto move = done_.rbegin(); move != done_.rend(); ++move)
      std::filesystem::rename(move->second, move->first, ignored);
  }
  Moves(const Moves&) = delete;
  Moves& operator=(const Moves&) = delete;
  void move(const std::filesystem::path& from, const std::filesystem::path& to) {
    std::filesystem::rename(from, to);
    done_.emplace_back(from, to);
  }
  void keep() { done_.clear(); }

 private:
  std::vector<std::pair<std::filesystem::path, std::filesystem::path>> done_;
};

std::set<std::string> names_in(const std::filesystem::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

/// What the last run wrote; names alone, whatever a hand may have put there.
std::set<std::string> last_written(const std::filesystem::path& folder) {
  std::set<std::string> names;
  std::ifstream stream(folder / OutputFolder::manifest, std::ios::binary);
  for (std::string name; std::getline(stream, name);)
    if (!name.empty() && std::filesystem::path(name).filename() == name && name != "." && name != "..")
      names.insert(name);
  return names;
}

/// Puts the files of `from` into `to`, and what they replace into `aside`: all, or none.
void replace_files(const std::filesystem::path& from, const std::filesystem::path& to,
                   const std::filesystem::path& aside) {
  const std::set<std::string> written = names_in(from);
  std::set<std::string> old = last_written(to);
  for (const std::string& name : written) {
    if (std::filesystem::is_directory(to / name))
      throw Error(fmt::format("{} is a folder, and a file of that name is to be written", (to / name).string()));
    old.insert(name);
  }
  Moves moves;
  for (const std::string& name : old)
    if (std::filesystem::is_regular_file(std::filesystem::symlink_status(to / name)) ||
        std::filesystem::is_symlink(to / name))
      moves.move(to / name, aside / name);
  for (const std::string& name : written) moves.move(from / name, to / name);
  moves.keep();
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

void OutputFolder::fill(const std::function<void(const std::filesystem::path&)>& write) const try {
  // Beside the folder or, when that exists and may be on another file system than its parent, inside it.
  const bool exists = std::filesystem::exists(folder_);
  const std::string name = fmt::format(".{}.tandem-{}", folder_.filename().string(), getpid());
  const TemporaryFolder temporary((exists ? folder_ : folder_.parent_path()) / name);
  const std::filesystem::path fresh = temporary.path() / "new", aside = temporary.path() / "old";
  std::filesystem::create_directory(fresh);
  std::filesystem::create_directory(aside);
  write(fresh);
  std::string written;
  for (const std::string& file : names_in(fresh)) written += file + "\n";
  write_file(fresh / manifest, written);
  std::error_code taken;
  if (!exists) std::filesystem::rename(fresh, folder_, taken);
  if (exists || taken) replace_files(fresh, folder_, aside);  // taken: somebody else has made it meanwhile
} catch (const std::filesystem::filesystem_error& error) {
  throw Error(fmt::format("--out {}: {}", folder_.string(), error.code().message()));
}

}  // namespace tandem
