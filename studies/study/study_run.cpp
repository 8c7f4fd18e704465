#include <algorithm>
#include <chrono>
#include <exception>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/study/study_run.hpp>
#include <tandem/studies/study/trial.hpp>

namespace tandem {
namespace {

std::vector<std::size_t> trials_to_do(const StudyDatabase& database, const Shard& shard) {
  const std::vector<bool> finished = database.finished();
  std::vector<std::size_t> to_do;
  for (std::size_t i = shard.index; i < finished.size(); i += shard.of)
    if (!finished[i]) to_do.push_back(i);
  return to_do;
}

std::size_t size_of(const Shard& shard, std::size_t trials) {
  return trials > shard.index ? (trials - shard.index + shard.of - 1) / shard.of : 0;
}

}  // namespace

StudyProgress run_study(StudyDatabase& database, const StudyRunOptions& options) {
  using Clock = std::chrono::steady_clock;
  const Study& study = database.study();
  const std::vector<std::size_t> to_do = trials_to_do(database, options.shard);
  const std::size_t cores = std::max(1u, std::thread::hardware_concurrency());
  const std::size_t threads =
      std::min(options.threads > 0 ? std::size_t(options.threads) : cores, std::max<std::size_t>(1, to_do.size()));

  StudyProgress progress;
  progress.all = size_of(options.shard, study.trials());
  const std::size_t before = progress.done = progress.all - to_do.size();
  const auto begun = Clock::now();
  std::mutex mutex;
  std::exception_ptr failure;
  std::atomic<std::size_t> next{0};
  std::atomic<bool> ended{false};
  const auto stopped = [&] { return ended || (options.stop && *options.stop); };
  const auto work = [&] {
    while (!stopped()) {
      const std::size_t i = next++;
      if (i >= to_do.size()) return;
      const TrialResult result = run_trial(study, to_do[i], options.stop);
      if (stopped()) return;
      const std::lock_guard lock(mutex);
      try {
        database.add(result);
      } catch (...) {
        if (!failure) failure = std::current_exception();
        ended = true;
        return;
      }
      ++progress.done;
      progress.failed += !result.converged();
      progress.rate = double(progress.done - before) / std::chrono::duration<double>(Clock::now() - begun).count();
      progress.seconds_left = double(progress.all - progress.done) / progress.rate;
      if (options.progress) options.progress(progress);
    }
  };
  {
    std::vector<std::jthread> pool;
    for (std::size_t i = 1; i < threads; ++i) pool.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
  return progress;
}

void merge_study(StudyDatabase& into, const StudyDatabase& from) {
  if (into.study().canonical() != from.study().canonical())
    throw Error(fmt::format("the studies differ: their hashes are {:016x} and {:016x}", into.study().hash(),
                            from.study().hash()));
  into.add_all(from.results());
}

}  // namespace tandem
