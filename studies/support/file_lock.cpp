#include <cerrno>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <tandem/studies/support/file_lock.hpp>

namespace tandem {

FileLock::FileLock(const std::filesystem::path& path, Busy busy) {
  std::error_code ignored;
  // Over NFS, only a file that is open for writing can be locked.
  const int flags = std::filesystem::is_directory(path, ignored) ? O_RDONLY | O_DIRECTORY
                                                                 : O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK;
  descriptor_ = open(path.c_str(), flags | O_CLOEXEC, 0666);
  if (descriptor_ < 0) {
    failure_ = errno;
    return;
  }
  const int mode = busy == Busy::wait ? LOCK_EX : LOCK_EX | LOCK_NB;
  do failure_ = flock(descriptor_, mode) == 0 ? 0 : errno;
  while (failure_ == EINTR);
}

FileLock::~FileLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

}  // namespace tandem
