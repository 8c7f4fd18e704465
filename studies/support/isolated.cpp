#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>

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
constexpr int kNoProgram = 127;             // exit status of a child that could not become the program, as a shell's
constexpr std::chrono::seconds kToStop{1};  // after it was told
constexpr int kPollMilliseconds = 50;

/// Becomes the program. Other threads of the parent may hold any lock: only what is safe in a signal handler is called.
[[noreturn]] void be_child(const char* program, char* const* arguments, int output, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // a killed parent leaves no solve behind
  if (getppid() != parent) _exit(1);
  struct sigaction action {};
  action.sa_handler = SIG_IGN;
  sigaction(SIGINT, &action, nullptr);
  dup2(output, STDOUT_FILENO);
  execv(program, arguments);
  _exit(kNoProgram);
}

}  // namespace

IsolatedRun run_isolated(const std::string& program, std::vector<std::string> arguments, double seconds,
                         const std::atomic<bool>& stop) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw Error(fmt::format("no pipe can be made: {}", std::strerror(errno)));
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const pid_t parent = getpid(), child = fork();
  if (child == 0) be_child(program.c_str(), argv.data(), ends[1], parent);
  const int reason = errno;
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    throw Error(fmt::format("no process can be started: {}", std::strerror(reason)));
  }

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
      if (n > 0) run.output.append(buffer, std::size_t(n));
    }
    if (stop && !told) {
      kill(child, SIGTERM);
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
  run.stopped = told;
  if (killed)
    run.failure =
        told ? "it was killed: it did not end when told to stop" : "it was killed: it ran on after its time limit";
  else if (told && WIFSIGNALED(status) && WTERMSIG(status) == SIGTERM)
    run.failure = "it was stopped before it had begun";
  else if (WIFSIGNALED(status))
    run.failure = fmt::format("it crashed with signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)));
  else if (WEXITSTATUS(status) == kNoProgram)
    run.failure = fmt::format("{} cannot be run", program);
  else
    run.failure = fmt::format("its process ended without a result (exit status {})", WEXITSTATUS(status));
  run.output.clear();
  return run;
}

}  // namespace tandem
