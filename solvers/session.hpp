#pragma once

#include <chrono>

#include "tandem/problem/program.hpp"
#include "tandem/solvers/summary.hpp"

namespace tandem::detail {

/// What every solver does around its iterations: it keeps the time, asks whether to stop, reports, and ends a solve.
class Session {
 public:
  Session(std::string solver, const SolverOptions& options);

  double seconds() const;
  /// True when the caller or the clock says so; the status is then set.
  bool should_stop();
  /// Tells the caller of an iteration.
  void report(int iteration, double cost, double step, double violation) const;
  /// Sets status and message; an empty message is the status's own sentence. The first to call wins.
  void end(Status status, std::string message = {});
  bool ended() const { return ended_; }

  /// Adds the time until it goes out of scope to a figure of the summary.
  class Timer {
   public:
    explicit Timer(double& total) : total_(total), start_(std::chrono::steady_clock::now()) {}
    ~Timer() { total_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

   private:
    double& total_;
    std::chrono::steady_clock::time_point start_;
  };

  Summary summary;

 private:
  const SolverOptions& options_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  bool ended_ = false;
};

}  // namespace tandem::detail
