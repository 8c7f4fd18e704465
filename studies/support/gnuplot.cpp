#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <tandem/studies/support/gnuplot.hpp>
#include <tandem/studies/support/text.hpp>

extern char** environ;

namespace tandem {
namespace {

using File = std::unique_ptr<std::FILE, decltype([](std::FILE* file) { std::fclose(file); })>;

/// The first line that says something.
std::string complaint(std::FILE* file) {
  std::rewind(file);
  char line[300];
  while (std::fgets(line, sizeof line, file)) {
    std::string text(line);
    while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
    if (!trimmed(text).empty() && trimmed(text) != "^") return ": " + text;
  }
  return "";
}

}  // namespace

std::string run_gnuplot(const std::string& script, const std::filesystem::path& file) {
  // The script goes through a temporary file, not a pipe, which a dead gnuplot would turn into a signal.
  const File input(std::tmpfile()), errors(std::tmpfile());
  if (!input || !errors || std::fwrite(script.data(), 1, script.size(), input.get()) != script.size())
    return "gnuplot's script cannot be written to a temporary file";
  std::rewind(input.get());

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, fileno(input.get()), STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
  posix_spawn_file_actions_adddup2(&actions, fileno(errors.get()), STDERR_FILENO);
  char program[] = "gnuplot", option[] = "-d", from_stdin[] = "-";  // -d: without the user's own settings
  char* const arguments[] = {program, option, from_stdin, nullptr};
  pid_t child = 0;
  const int failure = posix_spawnp(&child, program, &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  std::error_code ignored;
  if (failure != 0) std::filesystem::remove(file, ignored);
  if (failure == ENOENT) return "gnuplot is not installed, so no plots were drawn (Debian's package is gnuplot-nox)";
  if (failure != 0) return fmt::format("gnuplot does not start: {}", std::strerror(failure));

  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0 && !std::filesystem::is_empty(file, ignored)) return "";
  std::filesystem::remove(file, ignored);
  return fmt::format("gnuplot did not draw {}{}", file.filename().string(), complaint(errors.get()));
}

std::string gnuplot_string(const std::string& text) {
  std::string literal = "'";
  for (const char c : text) {
    if (c == '\'') literal += '\'';
    literal += (c == '\n' || c == '\r' || c == '\0') ? ' ' : c;
  }
  return literal + "'";
}

}  // namespace tandem
