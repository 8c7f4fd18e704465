#include <cerrno>
#include <csignal>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/replace_file.hpp>
#include <tandem/studies/support/durable_files.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::size_t kMaxPending = 64 << 20;  // bytes kept for a file whose writes fail
constexpr mode_t kMode = 0666;                 // before the umask is applied

std::string write_error(const std::filesystem::path& file, const std::error_code& reason) {
  return fmt::format("{} cannot be written: {}", printable(file.string()), reason.message());
}

std::error_code last_error() { return {errno, std::generic_category()}; }

}  // namespace

DurableFiles::DurableFiles(std::chrono::milliseconds period) : period_(period) {
  sigset_t all, before;  // the writer thread handles no signals
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { run(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

DurableFiles::~DurableFiles() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_one();
  thread_.join();
  for (const File& file : files_) close(file.descriptor);
}

std::size_t DurableFiles::open(const std::filesystem::path& path, std::uintmax_t keep) {
  // Neither follows a link nor waits for the reader of a pipe; ftruncate() fails on anything but a regular file.
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, kMode);
  if (descriptor < 0 || ftruncate(descriptor, off_t(keep)) != 0) {
    const std::error_code reason = last_error();
    if (descriptor >= 0) close(descriptor);
    throw Error(write_error(path, reason));
  }
  detail::sync_folder_of(path);
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
  flush_requested_ = true;
  wake_.notify_one();
}

void DurableFiles::flush() {
  std::unique_lock lock(mutex_);
  flush_requested_ = true;
  wake_.notify_one();
  written_.wait(lock, [&] { return !flush_requested_ && !busy_; });
}

std::string DurableFiles::failure() {
  const std::lock_guard lock(mutex_);
  return std::exchange(failure_, {});
}

void DurableFiles::run() {
  std::unique_lock lock(mutex_);
  for (bool last = false; !last;) {
    wake_.wait_for(lock, period_, [this] { return stopping_ || flush_requested_; });
    last = stopping_;
    flush_requested_ = false;
    busy_ = true;
    write_all(lock);
    busy_ = false;
    written_.notify_all();
  }
}

/// Writes everything pending. Releases the lock during disk operations. If a write fails, truncates the file to its
/// previous size, so that no partial text remains.
void DurableFiles::write_all(std::unique_lock<std::mutex>& lock) {
  bool all = true;
  // Takes the present replacements only: a later one may refer to text that is appended later.
  std::map<std::filesystem::path, std::string> replacements = std::exchange(replacements_, {});
  for (std::size_t i = 0; i < files_.size(); ++i) {
    if (files_[i].pending.empty()) continue;
    const std::string text = files_[i].pending;
    const int descriptor = files_[i].descriptor;
    const std::uintmax_t at = files_[i].written;
    lock.unlock();
    std::error_code reason = lseek(descriptor, off_t(at), SEEK_SET) < 0 ? last_error() : std::error_code();
    if (!reason) reason = detail::write_text(descriptor, text);
    if (reason && ftruncate(descriptor, off_t(at)) != 0) reason = last_error();
    if (!reason) reason = detail::sync_file(descriptor);
    lock.lock();
    File& file = files_[i];
    if (!reason) {
      file.pending.erase(0, text.size());
      file.written += text.size();
      continue;
    }
    all = false;
    failure_ = write_error(file.path, reason);
    if (file.pending.size() > kMaxPending) file.pending.clear();
  }
  if (!all) return replacements_.merge(replacements);  // retried later, unless replaced by a newer one
  for (auto& [path, text] : replacements) {
    lock.unlock();
    const std::error_code reason = detail::replace_file(path, text);
    lock.lock();
    if (!reason) continue;
    failure_ = write_error(path, reason);
    replacements_.try_emplace(path, std::move(text));  // retried later, unless replaced by a newer one
  }
}

void remove_partial_line(const std::filesystem::path& file) {
  InputFile stream(file);
  std::uintmax_t size = std::filesystem::file_size(file), end = size;
  for (char c = 0; end > 0; --end) {
    stream.seekg(std::streamoff(end - 1));
    if (!stream.get(c) || c == '\n') break;
  }
  if (end < size) std::filesystem::resize_file(file, end);
}

}  // namespace tandem
