#include <cerrno>
#include <csignal>
#include <cstdio>

#include <fcntl.h>
#include <unistd.h>
#if defined(__linux__)
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
