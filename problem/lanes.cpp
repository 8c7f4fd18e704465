#include <array>
#include <exception>

#include <tandem/lie/error.hpp>
#include <tandem/problem/lanes.hpp>

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
  if (threads < 1) throw Error("a limit of threads must be above zero");
  control_ = std::make_unique<Control>(threads);
}

struct detail::Lanes::Arena {
  explicit Arena(int threads) : arena(threads) {}
  tbb::task_arena arena;
};
#else
struct ThreadLimit::Control {};
ThreadLimit::ThreadLimit(int threads) {
  if (threads < 1) throw Error("a limit of threads must be above zero");
}

struct detail::Lanes::Arena {};
#endif

ThreadLimit::~ThreadLimit() = default;

namespace detail {

Lanes::Lanes() = default;
Lanes::~Lanes() = default;

void Lanes::use_threads(int threads) {
  if (threads < 0) throw Error("threads must not be below zero");
  if (threads == threads_) return;
  threads_ = threads;
  arena_.reset();
#ifdef TANDEM_HAS_TBB
  if (threads > 1) arena_ = std::make_unique<Arena>(threads);
#endif
}

void Lanes::run(int count, FunctionRef<void(int lane)> f) const {
#ifdef TANDEM_HAS_TBB
  if (count > 1 && threads_ != 1) {
    // All lanes run, whoever throws: which error is told must not depend on who was first.
    std::array<std::exception_ptr, kMostLanes> errors{};
    const auto guarded = [&](int lane) {
      try {
        f(lane);
      } catch (...) {
        errors[std::size_t(lane)] = std::current_exception();
      }
    };
    // Work stealing, not a barrier: where another thread is late, on a busy machine or since it slept, this one takes its
    // lanes too instead of waiting. Mostly each half goes to the same thread again, whose cache has what it wrote there.
    const auto all = [&] { tbb::parallel_for(0, count, guarded, tbb::simple_partitioner()); };
    if (arena_)
      arena_->arena.execute(all);
    else
      tbb::this_task_arena::isolate(all);  // a thread that waits here takes no task of who called
    for (const std::exception_ptr& error : errors)
      if (error) std::rethrow_exception(error);
    return;
  }
#endif
  for (int lane = 0; lane < count; ++lane) f(lane);
}

}  // namespace detail
}  // namespace tandem
