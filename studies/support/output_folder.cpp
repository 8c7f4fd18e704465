#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <set>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/output_folder.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

namespace fs = std::filesystem;

const std::string kFresh = "new";  // in a temporary folder: what is written, then, exchanged, what was there before
constexpr int kTries = 100;
const std::string kOwn = ".tandem-";   // begins names of what is not to be kept: the manifest, a probe of another run
const std::string kExchange = "swap";  // there once `new` is complete

/// While it lives, no other process has one of the same folder.
class FolderLock {
 public:
  explicit FolderLock(const fs::path& folder) : descriptor_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    while (descriptor_ >= 0 && flock(descriptor_, LOCK_EX) != 0 && errno == EINTR) continue;
  }
  ~FolderLock() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

/// Removes the folder it made, if it is still there, whatever happens.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(fs::path path) : path_(std::move(path)) { fs::create_directories(path_); }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::set<std::string> names_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

/// What a run has written there; names alone, whatever a hand may have put there.
std::set<std::string> last_written(const fs::path& folder) {
  std::set<std::string> names;
  std::ifstream stream(folder / OutputFolder::manifest, std::ios::binary);
  for (std::string name; std::getline(stream, name);)
    if (!name.empty() && fs::path(name).filename() == name && name != "." && name != "..") names.insert(name);
  return names;
}

/// What is in a folder that no run has put there: it stays.
std::set<std::string> foreign(const fs::path& folder) {
  std::set<std::string> names = names_in(folder);
  for (const std::string& name : last_written(folder))
    if (!fs::is_directory(fs::symlink_status(folder / name))) names.erase(name);
  std::erase_if(names, [](const std::string& name) { return name.starts_with(kOwn); });
  return names;
}

void check_replaceable(const fs::path& fresh, const fs::path& folder) {
  for (const std::string& name : names_in(fresh))
    if (fs::is_directory(folder / name))
      throw Error(
          fmt::format("{} is a folder, and a file of that name is to be written", printable((folder / name).string())));
}

bool rename_by(const fs::path& from, const fs::path& to, unsigned flags) {
  return renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), flags) == 0;
}

/// Moves what is in `old` and no run has put there into `folder`, where there is nothing of that name.
void rescue(const fs::path& old, const fs::path& folder) {
  for (const std::string& name : foreign(old)) {
    if (fs::exists(fs::symlink_status(folder / name))) continue;
    std::error_code error;
    fs::rename(old / name, folder / name, error);
    if (error && fs::exists(fs::symlink_status(old / name)))  // else its owner has removed it meanwhile
      throw fs::filesystem_error("", error);
  }
}

/// The whole folder for the other by one rename; false where the system cannot. Files of others are in both at that
/// moment, folders of others are moved after it.
bool exchange(const fs::path& fresh, const fs::path& folder, const fs::path& mark) {
  if (fs::equivalent(folder, fs::current_path())) return false;  // who stands in it would be left in the old one
  check_replaceable(fresh, folder);
  std::error_code ignored;
  const std::set<std::string> written = names_in(fresh);
  for (const std::string& name : foreign(folder))
    if (!written.contains(name) && fs::is_regular_file(fs::symlink_status(folder / name)))
      fs::create_hard_link(folder / name, fresh / name, ignored);
  fs::permissions(fresh, fs::status(folder).permissions(), ignored);
  write_file(mark, "");
  if (!rename_by(fresh, folder, RENAME_EXCHANGE)) return false;
  rescue(fresh, folder);
  return true;
}

/// File by file, where the folder itself cannot be replaced: all, or none unless the process is killed meanwhile.
void replace_files(const fs::path& fresh, const fs::path& folder, const fs::path& aside) {
  check_replaceable(fresh, folder);
  const std::set<std::string> written = last_written(fresh);
  std::set<std::string> old = last_written(folder);
  old.insert(written.begin(), written.end());
  old.insert(OutputFolder::manifest);
  std::vector<std::pair<fs::path, fs::path>> moved;
  try {
    const auto move = [&](const fs::path& from, const fs::path& to) {
      fs::rename(from, to);
      moved.emplace_back(from, to);
    };
    for (const std::string& name : old)
      if (const auto status = fs::symlink_status(folder / name); fs::is_regular_file(status) || fs::is_symlink(status))
        move(folder / name, aside / name);
    for (const std::string& name : written) move(fresh / name, folder / name);
    move(fresh / OutputFolder::manifest, folder / OutputFolder::manifest);
  } catch (...) {
    std::error_code ignored;
    for (auto move = moved.rbegin(); move != moved.rend(); ++move) fs::rename(move->second, move->first, ignored);
    throw;
  }
}

bool is_writable(const fs::path& folder) { return access(folder.c_str(), W_OK | X_OK) == 0; }

bool on_one_disk(const fs::path& a, const fs::path& b) {
  struct stat of_a {
  }, of_b{};
  return stat(a.c_str(), &of_a) == 0 && stat(b.c_str(), &of_b) == 0 && of_a.st_dev == of_b.st_dev;
}

std::string temporary_prefix(const fs::path& folder) { return fmt::format(".{}.tandem-", folder.filename().string()); }

/// Removes what killed runs have left beside the folder or in it; of what one had exchanged, what is not its own comes back.
void clean_up(const fs::path& where, const fs::path& folder) {
  std::error_code ignored;
  const std::string prefix = temporary_prefix(folder);
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(where, ignored))
    if (entry.path().filename().string().starts_with(prefix)) left.push_back(entry.path());
  for (const fs::path& path : left) {
    const std::string name = path.filename().string().substr(prefix.size());
    const auto process = whole_number(std::string_view(name).substr(0, name.find('-')));
    if (!process || kill(*process, 0) == 0 || errno == EPERM) continue;  // it is still at it
    if (fs::exists(path / kExchange) && fs::is_directory(path / kFresh) && fs::is_directory(folder))
      rescue(path / kFresh, folder);
    fs::remove_all(path, ignored);
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
  std::string probe;  // permissions alone do not tell
  for (int tries = 0; tries < kTries; ++tries) {
    probe = (existing / ".tandem-XXXXXX").string();
    if (mkdtemp(probe.data())) break;
    if (errno == ENOENT && tries + 1 < kTries) continue;  // another run has just replaced the folder
    throw Error(
        fmt::format("--out {}: {} cannot be written to: {}", folder.string(), existing.string(), std::strerror(errno)));
  }
  std::filesystem::remove(probe);
}

std::filesystem::path OutputFolder::partial() const {
  const fs::path folder = fs::weakly_canonical(folder_), parent = folder.parent_path();
  const bool inside = fs::is_directory(folder) && (!is_writable(parent) || !on_one_disk(folder, parent));
  return inside ? folder / "partial" : parent / (folder.filename().string() + ".partial");
}

void OutputFolder::fill(const std::function<void(const fs::path&)>& write) const try {
  static std::atomic<int> count{0};
  const fs::path folder = fs::weakly_canonical(folder_);  // not a link to it
  fs::create_directories(folder.parent_path());
  const bool beside = is_writable(folder.parent_path());
  const fs::path where = beside ? folder.parent_path() : folder;
  {
    const FolderLock lock(where);
    clean_up(where, folder);
    clean_up(folder, folder);
  }
  const std::string name = fmt::format("{}{}-{}", temporary_prefix(folder), getpid(), count++);
  const TemporaryFolder temporary(where / name);
  const fs::path fresh = temporary.path() / kFresh;
  fs::create_directory(fresh);
  write(fresh);
  std::string written;
  for (const std::string& file : names_in(fresh)) written += file + "\n";
  write_file(fresh / manifest, written);

  const FolderLock lock(where);
  if (rename_by(fresh, folder, RENAME_NOREPLACE)) return;
  if (!fs::exists(folder)) return fs::rename(fresh, folder);
  if (beside && exchange(fresh, folder, temporary.path() / kExchange)) return;
  const TemporaryFolder inside(folder / (name + "-in"));  // on the folder's own file system
  fs::create_directory(inside.path() / "old");
  fs::copy(fresh, inside.path() / kFresh, fs::copy_options::recursive);
  replace_files(inside.path() / kFresh, folder, inside.path() / "old");
} catch (const fs::filesystem_error& error) {
  throw Error(fmt::format("--out {}: {}", folder_.string(), error.code().message()));
}

}  // namespace tandem
