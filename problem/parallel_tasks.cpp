#include <algorithm>
#include <exception>
#include <mutex>
#include <string>

#include <tandem/lie/error.hpp>
#include <tandem/problem/parallel_tasks.hpp>

#ifdef TANDEM_HAS_TBB
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

namespace tandem {

#ifdef TANDEM_HAS_TBB
struct ThreadLimit::Control {
  explicit Control(int threads) : control(tbb::global_control::max_allowed_parallelism, std::size_t(threads)) {}
  tbb::global_control control;
};
ThreadLimit::ThreadLimit(int threads) {
  if (threads < 1)
    throw BadInputError("ThreadLimit: the number of threads must be at least 1, not " + std::to_string(threads));
  control_ = std::make_unique<Control>(threads);
}

struct detail::TaskRunner::Arena {
  // TBB prints a warning if an arena is larger than the number of threads that it may use.
  explicit Arena(int threads)
      : arena(std::min(threads, int(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)))) {
  }
  tbb::task_arena arena;
};
#else
struct ThreadLimit::Control {};
ThreadLimit::ThreadLimit(int threads) {
  if (threads < 1)
    throw BadInputError("ThreadLimit: the number of threads must be at least 1, not " + std::to_string(threads));
}

struct detail::TaskRunner::Arena {};
#endif

ThreadLimit::~ThreadLimit() = default;

namespace detail {

TaskRunner::TaskRunner() = default;
TaskRunner::~TaskRunner() = default;

void TaskRunner::use_threads(int threads) {
  if (threads < 0) throw BadInputError("the number of threads must not be negative; 0 uses one per core");
  if (threads == threads_) return;
  threads_ = threads;
  arena_.reset();
#ifdef TANDEM_HAS_TBB
  if (threads > 1) arena_ = std::make_unique<Arena>(threads);
#endif
}

void TaskRunner::run(int count, FunctionRef<void(int task)> f) const {
#ifdef TANDEM_HAS_TBB
  if (count > 1 && threads_ != 1) {
    // All tasks run even if one throws, so that the rethrown error does not depend on timing.
    std::mutex mutex;
    std::exception_ptr error;
    int first_error = count;
    const auto guarded = [&](int task) {
      try {
        f(task);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (task < first_error) {
          first_error = task;
          error = std::current_exception();
        }
      }
    };
    // Work stealing, not a barrier: if another thread is late because it slept or the machine is busy, this thread
    // takes over its tasks. Usually each thread gets the same tasks again, whose data are still in its cache.
    const auto all = [&] { tbb::parallel_for(0, count, guarded, tbb::simple_partitioner()); };
    if (arena_)
      arena_->arena.execute(all);
    else
      tbb::this_task_arena::isolate(all);  // while it waits, this thread takes no unrelated task of the caller
    if (error) std::rethrow_exception(error);
    return;
  }
#endif
  for (int task = 0; task < count; ++task) f(task);
}

}  // namespace detail
}  // namespace tandem
