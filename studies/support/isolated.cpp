#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/isolated.hpp>

namespace tandem {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kThrew = 70;                  // exit status of a child whose pipe holds what was thrown
constexpr std::chrono::seconds kToStop{5};  // after an interrupt
constexpr int kPollMilliseconds = 50;

bool write_all(int fd, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t n = write(fd, text.data() + done, text.size() - done);
    if (n < 0 && errno != EINTR) return false;
    done += n > 0 ? std::size_t(n) : 0;
  }
  return true;
}

[[noreturn]] void be_child(const std::function<std::string()>& work, int pipe, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // a killed parent leaves no solve behind
  if (getppid() != parent) _exit(1);
  // Ctrl-C reaches the whole group and the parent passes it on: both together are one interrupt.
  struct sigaction action {};
  sigaction(SIGINT, nullptr, &action);
  action.sa_flags &= ~static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  dup2(STDERR_FILENO, STDOUT_FILENO);
  int status = 0;
  std::string result;
  try {
    result = work();
  } catch (const std::exception& error) {
    result = error.what();
    status = kThrew;
  }
  if (!write_all(pipe, result)) status = 1;
  std::fflush(nullptr);
  _exit(status);  // no destructors: they are the parent's
}

}  // namespace

IsolatedRun run_isolated(const std::function<std::string()>& work, double seconds, const std::atomic<bool>& stop) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw Error(fmt::format("no pipe can be made: {}", std::strerror(errno)));
  std::fflush(nullptr);  // or the child would print it again
  const pid_t parent = getpid(), child = fork();
  if (child < 0) {
    const int reason = errno;
    close(ends[0]);
    close(ends[1]);
    throw Error(fmt::format("no process can be started: {}", std::strerror(reason)));
  }
  if (child == 0) {
    close(ends[0]);
    be_child(work, ends[1], parent);
  }
  close(ends[1]);

  IsolatedRun run;
  // An endless limit would overflow the clock.
  auto deadline = Clock::now() + std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * std::min(seconds, 1e9)));
  bool told = false, killed = false;
  for (char buffer[65536];;) {
    pollfd waiting{ends[0], POLLIN, 0};
    poll(&waiting, 1, kPollMilliseconds);
    if (waiting.revents != 0) {
      const ssize_t n = read(ends[0], buffer, sizeof buffer);
      if (n == 0) break;
      if (n > 0) run.result.append(buffer, std::size_t(n));
    }
    if (stop && !told) {
      kill(child, SIGINT);
      deadline = std::min(deadline, Clock::now() + kToStop);
      told = true;
    }
    if (!killed && Clock::now() > deadline) killed = kill(child, SIGKILL) == 0;
  }
  close(ends[0]);

  int status = 0;
  rusage usage{};
  while (wait4(child, &status, 0, &usage) < 0 && errno == EINTR) continue;
  run.peak_memory = 1024.0 * static_cast<double>(usage.ru_maxrss);  // kibibytes, on Linux
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return run;
  if (killed)
    run.failure =
        told ? "it was killed: it did not end when interrupted" : "it was killed: it ran on after its time limit";
  else if (WIFSIGNALED(status))
    run.failure = fmt::format("it crashed with signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)));
  else
    run.failure = WEXITSTATUS(status) == kThrew ? run.result : "its process ended without a result";
  run.result.clear();
  return run;
}

}  // namespace tandem
