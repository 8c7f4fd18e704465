#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>

#include <tandem/problem/function_ref.hpp>

namespace tandem {

/// Limits the number of threads that evaluate problems in this process, as long as the object lives. If there are
/// several limits, the smallest one applies. Has no effect if Tandem was built without oneTBB.
class ThreadLimit {
 public:
  /// `threads` may exceed the number of cores. Throws Error if it is less than 1.
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  struct Control;
  std::unique_ptr<Control> control_;
};

namespace detail {

/// Maximum number of tasks per evaluation of a problem, independent of the number of threads.
inline constexpr int kMaxTasks = 16;

/// Runs independent tasks on several threads (oneTBB), or one after the other if Tandem was built without it. The
/// caller splits the work into tasks in a way that does not depend on the number of threads. Results are then bitwise
/// equal for any number of threads.
class TaskRunner {
 public:
  TaskRunner();
  ~TaskRunner();

  /// Limits the number of threads used by run(); 0, the default, allows one per core. Throws Error if negative.
  void use_threads(int threads);
  /// Calls f(0), …, f(count − 1) and returns when all calls have ended. If calls throw, rethrows the exception of the
  /// lowest index.
  void run(int count, FunctionRef<void(int task)> f) const;

 private:
  struct Arena;

  int threads_ = 0;
  std::unique_ptr<Arena> arena_;  // null if the number of threads is unlimited or 1
};

/// Loop over a range [0, size), split into consecutive chunks that TaskRunner runs as tasks. The number of chunks
/// depends on `size` only, so sums are bitwise equal for any number of threads. On the unknowns of a large problem,
/// chunk k covers about the same unknowns as task k of NlpEvaluator, so its data tend to be in the cache of that
/// thread.
class ChunkedLoop {
 public:
  /// Uses a single chunk if size < min_size, because short loops are faster than starting tasks.
  ChunkedLoop(const TaskRunner& tasks, std::int64_t size, int min_size = 8000)
      : task_runner_(&tasks), size_(size), chunks_(size < min_size ? 1 : kMaxTasks) {}

  /// Returns the number of chunks.
  int count() const { return chunks_; }
  /// Calls f(chunk, begin, size) for each chunk.
  template <class F>
  void each(F f) const {
    task_runner_->run(chunks_, [&](int chunk) { f(chunk, begin(chunk), begin(chunk + 1) - begin(chunk)); });
  }
  /// Returns the sum of f(begin, size) over the chunks, added in their order.
  template <class F>
  double sum(F f) const {
    return combine(f, [](double a, double b) { return a + b; });
  }
  /// Returns the maximum of f(begin, size) over the chunks.
  template <class F>
  double max(F f) const {
    return combine(f, [](double a, double b) { return std::max(a, b); });
  }

 private:
  std::int64_t begin(int chunk) const { return size_ * chunk / chunks_; }
  template <class F, class Combine>
  double combine(F f, Combine combine) const {
    std::array<double, kMaxTasks> results;
    each([&](int chunk, std::int64_t begin, std::int64_t size) { results[std::size_t(chunk)] = f(begin, size); });
    double result = results[0];
    for (int chunk = 1; chunk < chunks_; ++chunk) result = combine(result, results[std::size_t(chunk)]);
    return result;
  }

  const TaskRunner* task_runner_;
  std::int64_t size_;
  int chunks_;
};

}  // namespace detail
}  // namespace tandem
