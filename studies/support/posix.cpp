#include <cerrno>
#include <csignal>
#include <cstdio>
#include <string>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#if defined(__linux__)
#include <stdio_ext.h>
#include <sys/prctl.h>
#endif

#include <tandem/studies/support/posix.hpp>

namespace tandem {

bool make_pipe(int (&ends)[2]) {
#if defined(__linux__)
  return pipe2(ends, O_CLOEXEC) == 0;
#else
  if (pipe(ends) != 0) return false;
  for (const int end : ends) fcntl(end, F_SETFD, FD_CLOEXEC);
  return true;
#endif
}

void end_with_parent() {
#if defined(__linux__)
  prctl(PR_SET_PDEATHSIG, SIGKILL);
#endif
}

void discard_output(std::FILE* stream) {
#if defined(__linux__)
  __fpurge(stream);
#else
  fpurge(stream);
#endif
  std::clearerr(stream);
}

std::string file_identity(const char* path) {
#if defined(__linux__) && defined(STATX_BTIME)
  struct statx status {};
  if (statx(AT_FDCWD, path, AT_SYMLINK_NOFOLLOW, STATX_INO | STATX_BTIME, &status) != 0) return "";
  const bool has_birth = (status.stx_mask & STATX_BTIME) != 0;
  return std::to_string(status.stx_ino) + "-" + std::to_string(has_birth ? status.stx_btime.tv_sec : 0) + "-" +
         std::to_string(has_birth ? status.stx_btime.tv_nsec : 0);
#else
  struct stat status {};
  return lstat(path, &status) == 0 ? std::to_string(status.st_ino) : "";
#endif
}

bool is_own_folder(const char* path) {
  struct stat status {};
  return lstat(path, &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == geteuid();
}

bool rename_atomically(const char* from, const char* to, RenameMode mode) {
#if defined(RENAME_EXCHANGE)
  return renameat2(AT_FDCWD, from, AT_FDCWD, to, mode == RenameMode::exchange ? RENAME_EXCHANGE : RENAME_NOREPLACE) ==
         0;
#else
  static_cast<void>(from);
  static_cast<void>(to);
  static_cast<void>(mode);
  errno = ENOSYS;
  return false;
#endif
}

}  // namespace tandem
