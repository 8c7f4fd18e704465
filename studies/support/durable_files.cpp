#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/durable_files.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::size_t kMostPending = 64 << 20;  // bytes, of a file that cannot be written
constexpr mode_t kMode = 0666;                  // less the user's mask

std::string why_not_written(const std::filesystem::path& file, int reason) {
  return fmt::format("{} cannot be written: {}", printable(file.string()), std::strerror(reason));
}

/// Writes all of it; returns errno, or 0.
int write_at(int descriptor, std::string_view text, std::uintmax_t at) {
  while (!text.empty()) {
    const ssize_t n = pwrite(descriptor, text.data(), text.size(), off_t(at));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return n < 0 ? errno : EIO;
    text.remove_prefix(std::size_t(n));
    at += std::uintmax_t(n);
  }
  return 0;
}

int synced(int descriptor) { return fdatasync(descriptor) == 0 || errno == EINVAL ? 0 : errno; }

/// Names in a folder are on the disk once that is; where the system can.
void sync_folder(const std::filesystem::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  fsync(descriptor);
  close(descriptor);
}

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : ".";
}

/// Returns errno, or 0: then the file is the new one, after a power failure too.
int replace_file(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path aside = file.string() + ".new";
  const int descriptor = ::open(aside.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode);
  if (descriptor < 0) return errno;
  int reason = write_at(descriptor, text, 0);
  if (reason == 0) reason = synced(descriptor);
  close(descriptor);
  if (reason == 0 && rename(aside.c_str(), file.c_str()) != 0) reason = errno;
  if (reason != 0)
    unlink(aside.c_str());
  else
    sync_folder(folder_of(file));
  return reason;
}

}  // namespace

DurableFiles::DurableFiles(std::chrono::milliseconds period) : period_(period) {
  sigset_t all, before;  // signals are the other threads'
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { run(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

DurableFiles::~DurableFiles() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  wake_.notify_one();
  thread_.join();
  for (const File& file : files_) close(file.descriptor);
}

std::size_t DurableFiles::open(const std::filesystem::path& path, std::uintmax_t keep) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, kMode);
  if (descriptor < 0 || ftruncate(descriptor, off_t(keep)) != 0) {
    const int reason = errno;
    if (descriptor >= 0) close(descriptor);
    throw Error(why_not_written(path, reason));
  }
  sync_folder(folder_of(path));
  const std::lock_guard lock(mutex_);
  files_.push_back({path, descriptor, keep, {}});
  return files_.size() - 1;
}

void DurableFiles::append(std::size_t file, std::string_view text) {
  const std::lock_guard lock(mutex_);
  files_[file].pending += text;
}

std::uintmax_t DurableFiles::size(std::size_t file) const {
  const std::lock_guard lock(mutex_);
  return files_[file].written + files_[file].pending.size();
}

void DurableFiles::replace(const std::filesystem::path& file, std::string text) {
  const std::lock_guard lock(mutex_);
  replacements_[file] = std::move(text);
  hurries_ = true;
  wake_.notify_one();
}

void DurableFiles::flush() {
  std::unique_lock lock(mutex_);
  hurries_ = true;
  wake_.notify_one();
  written_.wait(lock, [&] { return !hurries_ && !busy_; });
}

std::string DurableFiles::failure() {
  const std::lock_guard lock(mutex_);
  return std::exchange(failure_, {});
}

void DurableFiles::run() {
  std::unique_lock lock(mutex_);
  for (bool last = false; !last;) {
    wake_.wait_for(lock, period_, [this] { return ends_ || hurries_; });
    last = ends_;
    hurries_ = false;
    busy_ = true;
    write_all(lock);
    busy_ = false;
    written_.notify_all();
  }
}

/// With the lock, which is given up while the disk works. Whole pieces or none: after a failure a file ends where it did.
void DurableFiles::write_all(std::unique_lock<std::mutex>& lock) {
  bool all = true;
  // Those of now: what comes from here on may speak of what is appended from here on.
  std::map<std::filesystem::path, std::string> replacements = std::exchange(replacements_, {});
  for (std::size_t i = 0; i < files_.size(); ++i) {
    if (files_[i].pending.empty()) continue;
    const std::string text = files_[i].pending;
    const int descriptor = files_[i].descriptor;
    const std::uintmax_t at = files_[i].written;
    lock.unlock();
    int reason = write_at(descriptor, text, at);
    if (reason != 0 && ftruncate(descriptor, off_t(at)) != 0) reason = errno;
    if (reason == 0) reason = synced(descriptor);
    lock.lock();
    File& file = files_[i];
    if (reason == 0) {
      file.pending.erase(0, text.size());
      file.written += text.size();
      continue;
    }
    all = false;
    failure_ = why_not_written(file.path, reason);
    if (file.pending.size() > kMostPending) file.pending.clear();
  }
  if (!all) return replacements_.merge(replacements);  // later, unless there is a newer one
  for (auto& [path, text] : replacements) {
    lock.unlock();
    const int reason = replace_file(path, text);
    lock.lock();
    if (reason == 0) continue;
    failure_ = why_not_written(path, reason);
    replacements_.try_emplace(path, std::move(text));  // later, unless there is a newer one
  }
}

void cut_half_line(const std::filesystem::path& file) {
  std::ifstream stream = open_input(file);
  std::uintmax_t size = std::filesystem::file_size(file), end = size;
  for (char c = 0; end > 0; --end) {
    stream.seekg(std::streamoff(end - 1));
    if (!stream.get(c) || c == '\n') break;
  }
  if (end < size) std::filesystem::resize_file(file, end);
}

}  // namespace tandem
