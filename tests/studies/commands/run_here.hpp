#pragma once

#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <tandem/studies/commands/command.hpp>

namespace tandem {

/// Exit status, standard output and standard error of run_here().
struct RunHere {
  int status;
  std::string output, errors;
};

/// Runs `tandem probe WORDS` in this process. `prepare` defines the command `probe`.
inline RunHere run_here(std::function<std::function<int()>(CommandOptions&)> prepare,
                        const std::vector<std::string>& words) {
  std::vector<const char*> argv = {"tandem", "probe"};
  for (const std::string& word : words) argv.push_back(word.c_str());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  RunHere run{run_command({"probe", "To test options with", {std::move(prepare)}}, static_cast<int>(argv.size()),
                          argv.data(), "0"),
              {},
              {}};
  run.output = testing::internal::GetCapturedStdout();
  run.errors = testing::internal::GetCapturedStderr();
  return run;
}

}  // namespace tandem
