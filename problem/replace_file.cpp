#include <cerrno>

#include <fcntl.h>
#include <unistd.h>

#include <tandem/problem/replace_file.hpp>

namespace tandem::detail {
namespace {

std::error_code error(int number) { return {number, std::generic_category()}; }

/// Opens a file with further `flags`, writes the text and flushes it to the disk.
std::error_code write_whole(const std::filesystem::path& file, int flags, std::string_view text) {
  const int descriptor = open(file.c_str(), O_WRONLY | O_CLOEXEC | flags, 0666);
  if (descriptor < 0) return error(errno);
  std::error_code reason = write_text(descriptor, text);
  if (!reason) reason = sync_file(descriptor);
  if (close(descriptor) != 0 && !reason) reason = error(errno);
  return reason;
}

}  // namespace

std::error_code write_text(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = write(descriptor, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return error(n < 0 ? errno : EIO);
    text.remove_prefix(std::size_t(n));
  }
  return {};
}

std::error_code sync_file(int descriptor) {
  return fdatasync(descriptor) == 0 || errno == EINVAL ? std::error_code() : error(errno);
}

void sync_folder_of(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  fsync(descriptor);
  close(descriptor);
}

std::error_code replace_file(const std::filesystem::path& file, std::string_view text) {
  std::error_code reason;
  if (const auto status = std::filesystem::status(file, reason); exists(status) && !is_regular_file(status))
    return write_whole(file, O_TRUNC, text);
  std::filesystem::path target = std::filesystem::weakly_canonical(file, reason);
  if (reason) target = file;
  std::filesystem::path fresh = target;
  fresh += ".new";
  unlink(fresh.c_str());  // left by a killed run; a link of that name must not be followed
  reason = write_whole(fresh, O_CREAT | O_EXCL, text);
  if (!reason) std::filesystem::rename(fresh, target, reason);
  if (!reason) {
    sync_folder_of(target);
    return {};
  }
  std::error_code ignored;
  std::filesystem::remove(fresh, ignored);
  return reason;
}

}  // namespace tandem::detail
