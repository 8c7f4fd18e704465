#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <string>
#include <string_view>

#include <tandem/lie/error.hpp>

namespace tandem {

/// Thrown if a Stop ended a computation early.
class Stopped : public Error {
 public:
  using Error::Error;
};

/// Stop condition of a computation in several steps: a flag, a deadline, or both. The default never stops.
class Stop {
 public:
  Stop() = default;
  /// Stops when `flag` is true (if it is not null), or `time_limit` seconds from now. The flag must outlive the Stop.
  explicit Stop(const std::atomic<bool>* flag, double time_limit = HUGE_VAL) : flag_(flag) {
    const std::chrono::duration<double> limit(time_limit);
    if (limit < std::chrono::hours(24 * 365))
      deadline_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(limit);
  }
  /// Takes flag and time limit from solver options. The time starts now.
  template <class Options>
  requires requires(const Options& o) { Stop(o.stop, o.time_limit); }
  explicit Stop(const Options& options) : Stop(options.stop, options.time_limit) {}

  /// Returns whether the flag is set.
  bool interrupted() const { return flag_ && flag_->load(std::memory_order_relaxed); }
  /// Returns whether the flag is set or the deadline has passed.
  bool reached() const { return interrupted() || (deadline_ < Clock::time_point::max() && Clock::now() >= deadline_); }
  /// Throws Stopped with the message "WHAT: interrupted" or "WHAT: the time limit was reached" if the condition is
  /// reached.
  void check(std::string_view what) const {
    if (!reached()) return;
    throw Stopped(std::string(what) + (interrupted() ? ": interrupted" : ": the time limit was reached"));
  }
  /// Returns the same condition with 1 s more time. For reading and building a problem, because a stop there leaves no
  /// result to return.
  Stop with_grace() const {
    Stop stop = *this;
    if (deadline_ < Clock::time_point::max()) stop.deadline_ += std::chrono::seconds(1);
    return stop;
  }
  /// Writes the flag and the remaining time to the options of the next solve.
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
