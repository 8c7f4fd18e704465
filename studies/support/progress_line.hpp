#pragma once

#include <chrono>
#include <string>
#include <utility>

#include <tandem/solvers/summary.hpp>

namespace tandem {

/// A progress line of a solve on standard error. It is rewritten at most 10 times a second and erased by the
/// destructor.
class ProgressLine {
 public:
  /// `prefix` starts the line, e.g. "3/18 ipopt: ".
  explicit ProgressLine(std::string prefix = {}) : prefix_(std::move(prefix)) {}
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const Progress& progress);
  void show(const std::string& text);

 private:
  std::string prefix_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace tandem
