#pragma once

#include <atomic>
#include <functional>

#include <tandem/studies/study/study_database.hpp>

namespace tandem {

/// Which trials of a study a process does: those whose number is `index` modulo `of`.
struct Shard {
  std::size_t index = 0, of = 1;
};

/// How far a run is.
struct StudyProgress {
  std::size_t done = 0, all = 0;  ///< trials, those of earlier runs too
  std::size_t failed = 0;         ///< of this run: that did not converge or were refused
  double rate = 0;                ///< trials a second, of this run
  double seconds_left = 0;        ///< at that rate
};

struct StudyRunOptions {
  int threads = 0;  ///< 0: one each core
  Shard shard{};
  const std::atomic<bool>* stop = nullptr;                  ///< set it to end early: trials in flight are not kept
  std::function<void(const StudyProgress&)> progress = {};  ///< after each trial, one call at a time
};

/// Does all trials of the shard that the database does not have. Throws Error where it cannot be written.
StudyProgress run_study(StudyDatabase& database, const StudyRunOptions& options);

/// Adds the trials of `from` to `into`. Throws Error when they are of different studies.
void merge_study(StudyDatabase& into, const StudyDatabase& from);

}  // namespace tandem
