#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/gnuplot.hpp>
#include <tandem/studies/support/subprocess.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

using File = std::unique_ptr<std::FILE, decltype([](std::FILE* file) { std::fclose(file); })>;

/// Returns the last line of gnuplot's standard error that is neither empty, a caret nor a warning. gnuplot prints the
/// failing command first, then the reason.
std::string last_error_line(std::FILE* file) {
  std::rewind(file);
  std::string words;
  char line[300];
  while (std::fgets(line, sizeof line, file)) {
    const std::string_view text = trimmed(std::string_view(line, std::strcspn(line, "\n")));
    if (!text.empty() && text != "^" && text.find("arning:") == std::string_view::npos) words = text;
  }
  return words;
}

}  // namespace

GnuplotRun run_gnuplot(const std::filesystem::path& script, const std::vector<std::string>& arguments) {
  const std::filesystem::path program = find_program("gnuplot");
  if (program.empty())
    return {false, "", "no plots were drawn: gnuplot is not installed (Debian package: gnuplot-nox)"};
  const File errors(std::tmpfile());
  if (!errors) return {false, "", fmt::format("cannot run gnuplot: {}", std::strerror(errno))};
  std::vector<std::string> words = {"gnuplot", "-d", "-c", script.string()};  // -d ignores the user's settings
  words.insert(words.end(), arguments.begin(), arguments.end());
  static const std::atomic<bool> go_on{false};
  try {
    SubprocessRun run = run_subprocess(program, std::move(words), HUGE_VAL, go_on, fileno(errors.get()));
    if (run.failure.empty()) return {true, std::move(run.output), ""};
    const std::string line = last_error_line(errors.get());
    return {true, "", line.empty() ? "gnuplot failed without a message" : line};
  } catch (const Error& error) {
    return {false, "", fmt::format("cannot run gnuplot: {}", error.what())};
  }
}

}  // namespace tandem
