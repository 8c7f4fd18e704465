#include <array>
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

/// The last line that says something but a warning: gnuplot shows the command before what is wrong with it.
std::string last_words(std::FILE* file) {
  std::rewind(file);
  std::string words;
  char line[300];
  while (std::fgets(line, sizeof line, file)) {
    const std::string_view text = trimmed(std::string_view(line, std::strcspn(line, "\n")));
    if (!text.empty() && text != "^" && text.find("arning:") == std::string_view::npos) words = text;
  }
  return words;
}

/// Both ends of a pipe that no child inherits by itself.
class Pipe {
 public:
  Pipe() { there_ = pipe2(ends_.data(), O_CLOEXEC) == 0; }
  ~Pipe() {
    close_end(0);
    close_end(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  bool there() const { return there_; }
  int in() const { return ends_[1]; }
  void close_in() { close_end(1); }
  /// Everything until all writers have closed it.
  std::string read_all() {
    std::string text;
    std::array<char, 65536> part;
    while (true) {
      const ssize_t n = read(ends_[0], part.data(), part.size());
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) return text;
      text.append(part.data(), static_cast<std::size_t>(n));
    }
  }

 private:
  void close_end(std::size_t i) {
    if (there_ && ends_[i] >= 0) close(ends_[i]);
    ends_[i] = -1;
  }
  std::array<int, 2> ends_{-1, -1};
  bool there_ = false;
};

}  // namespace

GnuplotRun run_gnuplot(const std::filesystem::path& script, const std::vector<std::string>& arguments) {
  GnuplotRun run;
  Pipe pipe;
  const File errors(std::tmpfile());
  if (!errors || !pipe.there()) {
    run.complaint = fmt::format("gnuplot cannot be run: {}", std::strerror(errno));
    return run;
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, pipe.in(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, fileno(errors.get()), STDERR_FILENO);
  std::vector<std::string> words = {"gnuplot", "-d", "-c", script.string()};  // -d: without the user's own settings
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t child = 0;
  const int failure = posix_spawnp(&child, "gnuplot", &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  pipe.close_in();
  if (failure == ENOENT)
    run.complaint = "gnuplot is not installed, so no plots were drawn (Debian's package is gnuplot-nox)";
  else if (failure != 0)
    run.complaint = fmt::format("gnuplot does not start: {}", std::strerror(failure));
  if (failure != 0) return run;

  run.started = true;
  run.output = pipe.read_all();
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return run;
  run.complaint = last_words(errors.get());
  if (run.complaint.empty()) run.complaint = "gnuplot ended without a word";
  return run;
}

}  // namespace tandem
