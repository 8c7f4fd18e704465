#pragma once

#include <string>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "paths.hpp"
#include "studies/scratch.hpp"

extern char** environ;

namespace tandem {

/// Starts a program without a shell. Standard output goes to the file `output`, standard error to `error_fd`. Standard
/// input is the file `input`, if given.
inline pid_t start_program(const std::string& program, std::vector<std::string> arguments,
                           const std::filesystem::path& output, int error_fd, const std::filesystem::path& input = {}) {
  arguments.insert(arguments.begin(), program);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (!input.empty()) posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, input.c_str(), O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, error_fd, STDERR_FILENO);
  pid_t child = -1;
  EXPECT_EQ(posix_spawn(&child, program.c_str(), &actions, nullptr, argv.data(), environ), 0)
      << program << " does not start";
  posix_spawn_file_actions_destroy(&actions);
  return child;
}

/// Starts tandem.
inline pid_t start_tandem(std::vector<std::string> arguments, const std::filesystem::path& output, int error_fd,
                          const std::filesystem::path& input = {}) {
  return start_program(paths::executable, std::move(arguments), output, error_fd, input);
}

/// Waits for a child and returns its exit status, or -1 if a signal ended it.
inline int exit_status(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// Exit status, standard output and standard error of a program.
struct Outcome {
  int status;
  std::string output, errors;
};

inline Outcome run_program(const std::string& program, const std::vector<std::string>& arguments,
                           const std::filesystem::path& input = {}) {
  const ScratchFolder scratch;
  const int error_fd = open((scratch.path() / "errors").c_str(), O_WRONLY | O_CREAT, 0600);
  const int status = exit_status(start_program(program, arguments, scratch.path() / "output", error_fd, input));
  close(error_fd);
  return {status, read_file(scratch.path() / "output"), read_file(scratch.path() / "errors")};
}

inline Outcome run_tandem(const std::vector<std::string>& arguments, const std::filesystem::path& input = {}) {
  return run_program(paths::executable, arguments, input);
}

/// Runs tandem with invalid arguments. Expects exit status 1, no standard output and one line of standard error, which
/// it returns.
inline std::string rejection_as_given(const std::vector<std::string>& arguments) {
  const Outcome run = run_tandem(arguments);
  EXPECT_EQ(run.status, 1) << run.output << run.errors;
  EXPECT_EQ(run.output, "");
  EXPECT_THAT(run.errors, ::testing::ContainsRegex("^tandem: [^\n]+\n$")) << "one line";
  return run.errors;
}

/// Like rejection_as_given(), but adds an output folder (of solve, an output file) after the command name and expects
/// that it is not created.
inline std::string rejection(std::vector<std::string> arguments) {
  const ScratchFolder scratch;
  const char* const option = !arguments.empty() && arguments.front() == "solve" ? "--write-solution" : "--out";
  if (arguments.size() > 1) arguments.insert(arguments.begin() + 1, {option, (scratch.path() / "out").string()});
  const std::string sentence = rejection_as_given(arguments);
  EXPECT_THAT(files(scratch.path()), ::testing::IsEmpty());
  return sentence;
}

}  // namespace tandem
