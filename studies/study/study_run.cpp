#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <map>
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

/// Returns how two results of one trial differ, or an empty string. Ignores processor times, and rounding, which
/// depends on the machine.
std::string disagreement(const TrialResult& a, const TrialResult& b) {
  constexpr double kRounding = 1e-6;  // relative
  if (a.status != b.status) return fmt::format("its status is {} and {}", a.status, b.status);
  for (std::size_t i = 0; i < a.metrics.size(); ++i) {
    const TrialMetric& metric = trial_metrics()[i];
    if (metric.timing) continue;
    const auto text = [](const std::optional<double>& x) { return x ? fmt::format("{:.9g}", *x) : "missing"; };
    const auto &x = a.metrics[i], &y = b.metrics[i];
    if (x.has_value() != y.has_value() ||
        (x && !(std::abs(*x - *y) <= kRounding * std::max({1.0, std::abs(*x), std::abs(*y)}))))
      return fmt::format("{} is {} and {}", metric.name, text(x), text(y));
  }
  return "";
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
  const auto run_trials = [&] {
    while (!stopped()) {
      const std::size_t i = next++;
      if (i >= to_do.size()) return;
      const TrialResult result = run_trial(study, to_do[i], options.stop);
      if (stopped()) return;
      const std::lock_guard lock(mutex);
      database.add(result);
      ++progress.done;
      progress.failed += !result.converged();
      progress.rate = double(progress.done - before) / std::chrono::duration<double>(Clock::now() - begun).count();
      progress.seconds_left = double(progress.all - progress.done) / progress.rate;
      if (options.progress) options.progress(progress);
    }
  };
  const auto work = [&] {
    try {
      run_trials();
    } catch (...) {  // the database cannot be written, or memory is short
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
      ended = true;
    }
  };
  {
    std::vector<std::jthread> pool;
    pool.reserve(threads);
    try {
      for (std::size_t i = 1; i < threads; ++i) pool.emplace_back(work);
    } catch (const std::exception&) {  // the system allows no more threads; those that started do all trials
    }
    work();
  }
  if (failure) std::rethrow_exception(failure);
  return progress;
}

std::vector<TrialResult> merged_results(const std::vector<std::filesystem::path>& shards) {
  std::vector<TrialResult> merged;
  std::map<std::size_t, std::pair<std::size_t, std::size_t>> places;  // key: trial; value: index in `merged`, shard
  std::string canonical;
  for (std::size_t shard = 0; shard < shards.size(); ++shard) {
    const StudyDatabase database = StudyDatabase::read(shards[shard]);
    if (shard == 0) canonical = database.study().canonical();
    if (database.study().canonical() != canonical)
      throw Error(
          fmt::format("{} and {} are shards of different studies", shards[shard].string(), shards.front().string()));
    for (TrialResult& result : database.results()) {
      const auto [place, added] = places.try_emplace(result.trial, merged.size(), shard);
      if (added) {
        merged.push_back(std::move(result));
      } else if (const std::string difference = disagreement(merged[place->second.first], result);
                 !difference.empty()) {
        throw Error(fmt::format("{} and {} disagree on trial {}: {}; run that trial again in one of them",
                                shards[place->second.second].string(), shards[shard].string(), result.trial,
                                difference));
      }
    }
  }
  return merged;
}

}  // namespace tandem
