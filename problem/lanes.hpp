#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>

#include <tandem/problem/function_ref.hpp>

namespace tandem {

/// Bounds the threads that evaluate problems in this process while it lives; the least of several counts.
class ThreadLimit {
 public:
  /// `threads` above zero, which may be more than there are cores. Throws Error when it is not.
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  struct Control;
  std::unique_ptr<Control> control_;
};

namespace detail {

inline constexpr int kMostLanes = 16;

/// Runs the lanes of an evaluation, at once where threads are to be had. What a lane is, is decided by who asks and never
/// by the number of threads, so that no result depends on that.
class Lanes {
 public:
  Lanes();
  ~Lanes();

  /// At most so many threads from now on; 0: as many as there are. Throws Error when it is below zero.
  void use_threads(int threads);
  /// f(0) … f(count − 1), each once, count ≤ kMostLanes. Throws what the first of the lanes that threw did.
  void run(int count, FunctionRef<void(int lane)> f) const;

 private:
  struct Arena;

  int threads_ = 0;
  std::unique_ptr<Arena> arena_;  // where the number is given, and more than one
};

/// Consecutive parts of what is `size` long, as many whatever the number of threads, each in a lane. Of a long program's
/// unknowns they are about those that its own lanes write: what a processor has just written, it has at hand.
class LaneParts {
 public:
  /// One, unless there is `worth` of it: a pass through a shorter vector costs less than to hand it to a thread.
  LaneParts(const Lanes& lanes, std::int64_t size, int worth = 8000)
      : lanes_(&lanes), size_(size), parts_(size < worth ? 1 : kMostLanes) {}

  int count() const { return parts_; }
  /// f(part, begin, size) of each.
  template <class F>
  void each(F f) const {
    lanes_->run(parts_, [&](int part) { f(part, begin(part), begin(part + 1) - begin(part)); });
  }
  /// The sum of what f(begin, size) returns, in the order of the parts.
  template <class F>
  double sum(F f) const {
    return combine(f, [](double a, double b) { return a + b; });
  }
  /// The largest.
  template <class F>
  double max(F f) const {
    return combine(f, [](double a, double b) { return std::max(a, b); });
  }

 private:
  std::int64_t begin(int part) const { return size_ * part / parts_; }
  template <class F, class Combine>
  double combine(F f, Combine combine) const {
    std::array<double, kMostLanes> results;
    each([&](int part, std::int64_t begin, std::int64_t size) { results[std::size_t(part)] = f(begin, size); });
    double result = results[0];
    for (int part = 1; part < parts_; ++part) result = combine(result, results[std::size_t(part)]);
    return result;
  }

  const Lanes* lanes_;
  std::int64_t size_;
  int parts_;
};

}  // namespace detail
}  // namespace tandem
