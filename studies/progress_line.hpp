#pragma once

#include <chrono>

#include <tandem/solvers/summary.hpp>

namespace tandem {

/// One line on standard error that follows a solve, rewritten some ten times a second and erased at the end.
class ProgressLine {
 public:
  ProgressLine() = default;
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const Progress& progress);

 private:
  bool shown_ = false;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace tandem
