#pragma once

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

}  // namespace detail
}  // namespace tandem
