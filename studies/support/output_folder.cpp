#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <set>
#include <vector>

#include <fmt/format.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/file_lock.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/output_folder.hpp>
#include <tandem/studies/support/posix.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

namespace fs = std::filesystem;

const std::string kFresh = "new";  // subfolder of the temporary folder: the new files; after the exchange, the old ones
constexpr int kTries = 100;
const std::string kInternal = ".tandem-";  // prefix of the manifest and of the write probes of other runs
const std::string kExchange = "swap";      // marker file: `new` is complete and may have been exchanged
const std::string kScenario = "scenario.yaml";

std::string& run_file_text() {
  static std::string text;
  return text;
}

/// Returns the name of the empty folder by which a temporary folder is recognised as this user's own. Neither another
/// user nor the author of a copied folder can know the identity.
std::string own_mark(const fs::path& folder) { return "id-" + file_identity(folder.c_str()); }

/// Removes a temporary folder, its mark last: a folder that a killed process leaves half removed is still recognised.
void remove_marked(const fs::path& folder) {
  std::error_code ignored;
  const std::string mark = own_mark(folder);
  for (const auto& entry : fs::directory_iterator(folder, ignored))
    if (entry.path().filename() != mark) fs::remove_all(entry.path(), ignored);
  fs::remove_all(folder, ignored);
}

/// Creates a folder that only this user may enter, and removes it in the destructor.
class TemporaryFolder {
 public:
  /// Random letters follow `prefix` in the name.
  explicit TemporaryFolder(const fs::path& prefix) {
    std::string name = prefix.string() + "XXXXXX";
    if (!mkdtemp(name.data())) throw fs::filesystem_error("", {errno, std::generic_category()});
    path_ = name;
    fs::create_directory(path_ / own_mark(path_));
  }
  ~TemporaryFolder() { remove_marked(path_); }
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

/// Returns the file names in the manifest of the last run, none if it is not a readable file. Ignores lines that are
/// not plain file names, so that an edited manifest cannot lead out of the folder.
std::set<std::string> files_of_last_run(const fs::path& folder) {
  const fs::path manifest = folder / OutputFolder::manifest;
  if (!fs::is_regular_file(fs::symlink_status(manifest))) return {};
  const std::string text = read_state(manifest);
  std::set<std::string> names;
  for (const std::string_view line : split(text, '\n'))
    if (const fs::path name(line); !line.empty() && name.filename() == name && name != "." && name != "..")
      names.insert(name);
  return names;
}

/// Returns a file of one of these names that Tandem did not write, or an empty path.
fs::path foreign_file(const fs::path& folder, const std::set<std::string>& names) {
  const std::set<std::string> own = files_of_last_run(folder);
  for (const std::string& name : names)
    if (const auto status = fs::symlink_status(folder / name);
        fs::exists(status) && !fs::is_directory(status) && !own.contains(name) && name != OutputFolder::manifest)
      return folder / name;
  const auto manifest = fs::symlink_status(folder / OutputFolder::manifest);
  return fs::exists(manifest) && !fs::is_regular_file(manifest) ? folder / OutputFolder::manifest : fs::path();
}

/// Returns the files of the last run that the next one, which writes `names`, replaces or removes. A scenario is
/// removed only by another one.
std::set<std::string> replaceable_files(const fs::path& folder, const std::set<std::string>& names) {
  const std::set<std::string> files = files_of_last_run(folder);
  return files.contains(kScenario) && !names.contains(kScenario) ? std::set<std::string>() : files;
}

/// Returns the names of the entries of a folder that belong to the user if the next run writes `names`.
std::set<std::string> user_entries(const fs::path& folder, const std::set<std::string>& written) {
  std::set<std::string> names = names_in(folder);
  for (const std::string& name : replaceable_files(folder, written))
    if (!fs::is_directory(fs::symlink_status(folder / name))) names.erase(name);
  std::erase_if(names, [](const std::string& name) { return name.starts_with(kInternal); });
  return names;
}

void check_replaceable(const fs::path& fresh, const fs::path& folder) {
  for (const std::string& name : names_in(fresh))
    if (fs::is_directory(folder / name))
      throw Error(fmt::format("{} is a folder; remove or rename it, since a file of that name must be written",
                              printable((folder / name).string())));
}

/// Moves user entries from `old` to `folder`, except those whose name exists there.
void move_user_entries(const fs::path& old, const fs::path& folder) {
  for (const std::string& name : user_entries(old, files_of_last_run(folder))) {
    if (fs::exists(fs::symlink_status(folder / name))) continue;
    std::error_code error;
    fs::rename(old / name, folder / name, error);
    if (error && fs::exists(fs::symlink_status(old / name)))  // not removed by its owner meanwhile
      throw fs::filesystem_error("", error);
  }
}

/// Exchanges two folders by one atomic rename. Returns false if the system does not support it. User files are linked
/// into the new folder before the rename; user folders are moved after it.
bool exchange(const fs::path& fresh, const fs::path& folder, const fs::path& mark) {
  if (fs::equivalent(folder, fs::current_path())) return false;  // the current folder would become the old one
  check_replaceable(fresh, folder);
  std::error_code ignored;
  const std::set<std::string> written = names_in(fresh);
  for (const std::string& name : user_entries(folder, written))
    if (!written.contains(name) && fs::is_regular_file(fs::symlink_status(folder / name)))
      fs::create_hard_link(folder / name, fresh / name, ignored);
  fs::permissions(fresh, fs::status(folder).permissions(), ignored);
  write_file(mark, "");
  if (!rename_atomically(fresh.c_str(), folder.c_str(), RenameMode::exchange)) return false;
  move_user_entries(fresh, folder);
  return true;
}

/// Replaces files one by one, for folders that cannot be exchanged. Restores all old files if one replacement fails.
/// Not atomic if the process is killed.
void replace_files(const fs::path& fresh, const fs::path& folder, const fs::path& aside) {
  check_replaceable(fresh, folder);
  const std::set<std::string> written = files_of_last_run(fresh);
  std::set<std::string> old = replaceable_files(folder, written);
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

bool on_same_file_system(const fs::path& a, const fs::path& b) {
  struct stat of_a {
  }, of_b{};
  return stat(a.c_str(), &of_a) == 0 && stat(b.c_str(), &of_b) == 0 && of_a.st_dev == of_b.st_dev;
}

std::string temporary_prefix(const fs::path& folder) { return fmt::format(".{}.tandem-", folder.filename().string()); }

/// Removes temporary folders that killed runs of this user left in `where`. Moves user entries back if a run was killed
/// after the exchange. Does not follow links.
void clean_up(const fs::path& where, const fs::path& folder) {
  std::error_code ignored;
  const std::string prefix = temporary_prefix(folder);
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(where, ignored))
    if (entry.path().filename().string().starts_with(prefix) && is_own_folder(entry.path().c_str()))
      left.push_back(entry.path());
  for (const fs::path& path : left) {
    const std::string name = path.filename().string().substr(prefix.size());
    const auto process = parse_positive_integer(std::string_view(name).substr(0, name.find('-')));
    if (!process || kill(*process, 0) == 0 || errno == EPERM) continue;  // that run is still alive
    if (!is_own_folder((path / own_mark(path)).c_str())) {
      rmdir(path.c_str());  // left by a run that was killed before it marked the folder; fails unless it is empty
      continue;
    }
    if (fs::is_regular_file(fs::symlink_status(path / kExchange)) && is_own_folder((path / kFresh).c_str()) &&
        fs::is_directory(folder))
      move_user_entries(path / kFresh, folder);
    remove_marked(path);
  }
}

}  // namespace

OutputFolder::OutputFolder(std::filesystem::path folder) {
  if (folder.empty()) throw Error("--out needs a folder name");
  folder_ = std::filesystem::absolute(folder).lexically_normal();
  if (!folder_.has_filename()) folder_ = folder_.parent_path();  // "DIR/"
  std::filesystem::path existing = folder_;
  while (!std::filesystem::exists(existing)) existing = existing.parent_path();
  if (!std::filesystem::is_directory(existing))
    throw Error(fmt::format("--out {}: {} is not a folder", folder.string(), existing.string()));
  std::string probe;  // permission bits do not show read-only and full file systems
  for (int tries = 0; tries < kTries; ++tries) {
    probe = (existing / ".tandem-XXXXXX").string();
    if (mkdtemp(probe.data())) break;
    if (errno == ENOENT && tries + 1 < kTries) continue;  // another run has just replaced the folder
    throw Error(
        fmt::format("--out {}: cannot write to {}: {}", folder.string(), existing.string(), std::strerror(errno)));
  }
  std::filesystem::remove(probe);
}

std::filesystem::path OutputFolder::partial() const {
  const fs::path folder = fs::weakly_canonical(folder_), parent = folder.parent_path();
  const bool inside = fs::is_directory(folder) && (!is_writable(parent) || !on_same_file_system(folder, parent));
  return inside ? folder / "partial" : parent / (folder.filename().string() + ".partial");
}

void set_run_file(std::string text) { run_file_text() = std::move(text); }

void OutputFolder::check_overwritable(const std::set<std::string>& names) const {
  if (forced_ || !fs::is_directory(folder_)) return;
  if (files_of_last_run(folder_).contains(kScenario) && !names.contains(kScenario))
    throw Error(
        fmt::format("--out {}: the folder is a scenario that tandem wrote; name another folder, or add --force "
                    "to write the results into it and keep the scenario",
                    folder_.string()));
  if (const fs::path file = foreign_file(folder_, names); !file.empty())
    throw Error(fmt::format("--out {}: tandem did not write {}; name another folder, or add --force to overwrite it",
                            folder_.string(), file.filename().string()));
}

void OutputFolder::check(const std::vector<std::string>& names) const {
  check_overwritable({names.begin(), names.end()});
  if (!forced_) refuse_inputs_in(folder_);
}

void OutputFolder::fill(const std::function<void(const fs::path&)>& write) const try {
  const fs::path folder = fs::weakly_canonical(folder_);  // resolves a symbolic link
  fs::create_directories(folder.parent_path());
  const bool beside = is_writable(folder.parent_path());
  const fs::path where = beside ? folder.parent_path() : folder;
  {
    const FileLock lock(where, FileLock::Busy::wait);
    clean_up(where, folder);
    clean_up(folder, folder);
  }
  const std::string name = fmt::format("{}{}-", temporary_prefix(folder), getpid());
  const TemporaryFolder temporary(where / name);
  const fs::path fresh = temporary.path() / kFresh;
  fs::create_directory(fresh);
  write(fresh);
  if (!run_file_text().empty()) write_file(fresh / "run.yaml", run_file_text());
  std::string written;
  for (const std::string& file : names_in(fresh)) written += file + "\n";
  write_file(fresh / manifest, written);

  const FileLock lock(where, FileLock::Busy::wait);
  check_overwritable(names_in(fresh));
  if (rename_atomically(fresh.c_str(), folder.c_str(), RenameMode::no_replace)) return;
  if (!fs::exists(folder)) return fs::rename(fresh, folder);
  if (beside && exchange(fresh, folder, temporary.path() / kExchange)) return;
  const TemporaryFolder inside(folder / name);  // on the same file system as the folder
  fs::create_directory(inside.path() / "old");
  fs::copy(fresh, inside.path() / kFresh, fs::copy_options::recursive);
  replace_files(inside.path() / kFresh, folder, inside.path() / "old");
} catch (const fs::filesystem_error& error) {
  throw Error(fmt::format("--out {}: {}", folder_.string(), error.code().message()));
}

}  // namespace tandem
