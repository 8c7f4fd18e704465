#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <string>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// Work was left before its end, as it was asked to: see Stop.
class Stopped : public Error {
 public:
  using Error::Error;
};

/// When work of several parts is to end early: at a time, or as soon as a flag is set. Never by default.
class Stop {
 public:
  Stop() = default;
  /// The limits of a solve, from now on, for all that is to be done with it.
  explicit Stop(const SolverOptions& options) : flag_(options.stop) {
    const std::chrono::duration<double> limit(options.time_limit);
    if (limit < std::chrono::hours(24 * 365))
      deadline_ = std::chrono::steady_clock::now() + std::chrono::duration_cast<Clock::duration>(limit);
  }

  bool interrupted() const { return flag_ && flag_->load(std::memory_order_relaxed); }
  bool reached() const { return interrupted() || (deadline_ < Clock::time_point::max() && Clock::now() >= deadline_); }
  /// Throws Stopped, "WHAT: interrupted" or "WHAT: the time limit was reached", once it is reached.
  void check(const char* what) const {
    if (!reached()) return;
    throw Stopped(std::string(what) + (interrupted() ? ": interrupted" : ": the time limit was reached"));
  }
  /// The limits of the next solve: what is left of the time.
  template <class Options>
  void limit(Options& options) const {
    options.stop = flag_;
    if (deadline_ == Clock::time_point::max()) return;
    options.time_limit = std::max(0.0, std::chrono::duration<double>(deadline_ - Clock::now()).count());
  }

 private:
  using Clock = std::chrono::steady_clock;
  const std::atomic<bool>* flag_ = nullptr;
  Clock::time_point deadline_ = Clock::time_point::max();
};

}  // namespace tandem
