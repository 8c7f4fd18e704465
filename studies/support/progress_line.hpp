#pragma once

#include <chrono>
#include <string>
#include <utility>

#include <tandem/solvers/summary.hpp>

namespace tandem {

/// One line on standard error that follows a solve, rewritten some ten times a second and erased at the end.
class ProgressLine {
 public:
  /// `what` begins the line, e.g. "3/18 ipopt: ".
  explicit ProgressLine(std::string what = {}) : what_(std::move(what)) {}
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const Progress& progress);
  /// Anything else that goes on.
  void show(const std::string& text);

 private:
  std::string what_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace tandem
