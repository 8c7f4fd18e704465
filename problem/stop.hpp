#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <string>
#include <string_view>

#include <tandem/lie/error.hpp>

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
  /// As soon as `flag` is set (none: never), or after `time_limit` s from now on.
  explicit Stop(const std::atomic<bool>* flag, double time_limit = HUGE_VAL) : flag_(flag) {
    const std::chrono::duration<double> limit(time_limit);
    if (limit < std::chrono::hours(24 * 365))
      deadline_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(limit);
  }
  /// The limits of a solve's options, from now on, for all that is to be done with it.
  template <class Options>
  requires requires(const Options& o) { Stop(o.stop, o.time_limit); }
  explicit Stop(const Options& options) : Stop(options.stop, options.time_limit) {}

  bool interrupted() const { return flag_ && flag_->load(std::memory_order_relaxed); }
  bool reached() const { return interrupted() || (deadline_ < Clock::time_point::max() && Clock::now() >= deadline_); }
  /// Throws Stopped, "WHAT: interrupted" or "WHAT: the time limit was reached", once it is reached.
  void check(std::string_view what) const {
    if (!reached()) return;
    throw Stopped(std::string(what) + (interrupted() ? ": interrupted" : ": the time limit was reached"));
  }
  /// The same with a second more: of reading and building, without which there is nothing to give.
  Stop with_grace() const {
    Stop stop = *this;
    if (deadline_ < Clock::time_point::max()) stop.deadline_ += std::chrono::seconds(1);
    return stop;
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
