#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "exit_of_forks.hpp"

namespace tandem::python {

void end_forks_without_destructors() {
#ifdef __GLIBC__  // on_exit() passes the exit status; Ipopt with MPI is Debian's
  static const pid_t importer = getpid();
  on_exit(
      [](int status, void*) {
        if (getpid() == importer) return;
        std::fflush(nullptr);
        _exit(status);
      },
      nullptr);
#endif
}

}  // namespace tandem::python
