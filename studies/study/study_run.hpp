#pragma once

#include <atomic>
#include <functional>

#include <tandem/studies/study/study_database.hpp>

namespace tandem {

/// Subset of the trials of a study: those whose number is `index` modulo `of`.
struct Shard {
  std::size_t index = 0, of = 1;
};

/// Progress of a run.
struct StudyProgress {
  std::size_t done = 0, all = 0;  ///< trials, including those of earlier runs
  std::size_t failed = 0;         ///< trials of this run that were rejected or did not converge
  double rate = 0;                ///< trials per second in this run
  double seconds_left = 0;        ///< time left at that rate
};

struct StudyRunOptions {
  int threads = 0;  ///< number of concurrent trials; 0: number of cores
  Shard shard{};
  const std::atomic<bool>* stop = nullptr;                  ///< ends the run if true; discards trials in progress
  std::function<void(const StudyProgress&)> progress = {};  ///< called after each trial, never concurrently
};

/// Runs all trials of the shard that are missing in the database. Throws Error if it cannot be written.
StudyProgress run_study(StudyDatabase& database, const StudyRunOptions& options);

/// Returns the trials of all shards of a study. Throws Error if the folders belong to different studies, or have
/// different results of one trial.
std::vector<TrialResult> merged_results(const std::vector<std::filesystem::path>& shards);

}  // namespace tandem
