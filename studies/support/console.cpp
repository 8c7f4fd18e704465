#include <csignal>
#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

std::atomic<bool> flag{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets the flag");

void redirect_output(int to) {
  std::fflush(stdout);
  dup2(to, STDOUT_FILENO);
}

}  // namespace

const std::atomic<bool>& interrupted() { return flag; }

void stop_on_interrupt() {
  struct sigaction action {};
  action.sa_handler = [](int) { flag = true; };
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

void warn(std::string_view sentence) { fmt::print(stderr, "tandem: {}\n", printable(sentence)); }

StdoutToStderr::StdoutToStderr() : output_(dup(STDOUT_FILENO)) { redirect_output(STDERR_FILENO); }

StdoutToStderr::~StdoutToStderr() {
  redirect_output(output_);
  close(output_);
}

}  // namespace tandem
