#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/posix.hpp>
#include <tandem/studies/support/subprocess.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kNoProgram = 127;                  // exit status if execv() fails, as in shells
constexpr std::chrono::seconds kStopTimeout{1};  // time between SIGTERM and SIGKILL
constexpr int kPollMilliseconds = 50;

/// Runs in the forked child and executes the program. Calls only async-signal-safe functions, since threads of the
/// parent may have held locks during the fork.
[[noreturn]] void exec_child(const char* program, char* const* arguments, int output, int errors, pid_t parent) {
  end_with_parent();
  if (getppid() != parent) _exit(1);
  struct sigaction action {};
  action.sa_handler = SIG_IGN;
  sigaction(SIGINT, &action, nullptr);
  dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(errors, STDERR_FILENO);
  execv(program, arguments);
  _exit(kNoProgram);
}

}  // namespace

SubprocessRun run_subprocess(const std::string& program, std::vector<std::string> arguments, double seconds,
                             const std::atomic<bool>& stop, int errors) {
  int ends[2];
  if (!make_pipe(ends)) throw Error(fmt::format("cannot create a pipe: {}", std::strerror(errno)));
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const pid_t parent = getpid(), child = fork();
  if (child == 0) exec_child(program.c_str(), argv.data(), ends[1], errors, parent);
  const int reason = errno;
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    throw Error(fmt::format("cannot start a process: {}", std::strerror(reason)));
  }

  SubprocessRun run;
  // Bounds the time limit, since infinity would overflow the clock.
  auto deadline = Clock::now() + std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * std::min(seconds, 1e9)));
  bool terminated = false, killed = false;
  for (char buffer[65536];;) {
    pollfd waiting{ends[0], POLLIN, 0};
    poll(&waiting, 1, kPollMilliseconds);
    if (waiting.revents != 0) {
      const ssize_t n = read(ends[0], buffer, sizeof buffer);
      if (n == 0) break;
      if (n > 0) run.output.append(buffer, std::size_t(n));
    }
    if (stop && !terminated) {
      kill(child, SIGTERM);
      deadline = std::min(deadline, Clock::now() + kStopTimeout);
      terminated = true;
    }
    if (!killed && Clock::now() > deadline) killed = kill(child, SIGKILL) == 0;
  }
  close(ends[0]);

  int status = 0;
  rusage usage{};
  while (wait4(child, &status, 0, &usage) < 0 && errno == EINTR) continue;
  run.peak_memory = 1024.0 * static_cast<double>(usage.ru_maxrss);  // kibibytes, on Linux
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return run;
  run.stopped = terminated;
  if (killed)
    run.failure = terminated ? "the process was killed because it did not stop on SIGTERM"
                             : "the process was killed because it exceeded its time limit";
  else if (terminated && WIFSIGNALED(status) && WTERMSIG(status) == SIGTERM)
    run.failure = "the process was interrupted before it had a result";
  else if (WIFSIGNALED(status))
    run.failure = fmt::format("the process crashed with signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)));
  else if (WEXITSTATUS(status) == kNoProgram)
    run.failure = fmt::format("{} cannot be run", program);
  else
    run.failure = fmt::format("the process ended without a result (exit status {})", WEXITSTATUS(status));
  run.output.clear();
  return run;
}

std::filesystem::path find_program(const std::string& name) {
  const char* const path = std::getenv("PATH");
  for (const std::string_view folder : split(path ? path : "", ':'))
    if (const auto file = std::filesystem::path(folder) / name; access(file.c_str(), X_OK) == 0) return file;
  return {};
}

}  // namespace tandem
