#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/posix.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

std::atomic<bool> flag{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets the flag");

std::atomic<int> output_error{0};  // errno of the first failed write to standard output

void keep_output_error() {
  int none = 0;
  output_error.compare_exchange_strong(none, errno ? errno : EIO);
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

void prepare_standard_streams() {
  std::signal(SIGPIPE, SIG_IGN);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})  // open() returns the lowest free descriptor
    if (fcntl(stream, F_GETFD) < 0 && errno == EBADF)
      open("/dev/null", stream == STDERR_FILENO ? O_RDWR : O_RDONLY);  // writes to standard output still fail
}

void print(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) keep_output_error();
}

int flush_output() {
  if (std::fflush(stdout) != 0) {
    keep_output_error();
    discard_output(stdout);
  }
  return output_error;
}

std::string output_failure() {
  const int reason = flush_output();
  return reason == 0 ? "" : fmt::format("cannot write to standard output: {}", std::strerror(reason));
}

void print_error(std::string_view text) {
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
}

void warn(std::string_view sentence) { print_error(fmt::format("tandem: {}\n", printable(sentence))); }

StdoutToStderr::StdoutToStderr() {
  flush_output();
  output_ = dup(STDOUT_FILENO);
  dup2(STDERR_FILENO, STDOUT_FILENO);
}

StdoutToStderr::~StdoutToStderr() {
  if (std::fflush(stdout) != 0) discard_output(stdout);  // standard error is closed or full
  dup2(output_, STDOUT_FILENO);
  close(output_);
}

}  // namespace tandem
