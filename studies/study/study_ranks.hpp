#pragma once

#include <memory>

#include <tandem/studies/study/study_run.hpp>

namespace tandem {

/// MPI processes of a study: rank 0, which owns the database, and workers. Rank 0 assigns one trial at a time to each
/// worker. Workers send heartbeats. Rank 0 reassigns the trial of a worker that is silent for 30 s, so a lost host
/// costs only the trials in progress.
class StudyRanks {
 public:
  /// Initialises MPI and returns the ranks, or nullptr if a launcher (mpirun, srun) did not start several processes.
  /// Throws Error if it did and this build has no MPI.
  static std::unique_ptr<StudyRanks> launched();
  ~StudyRanks();
  StudyRanks(const StudyRanks&) = delete;
  StudyRanks& operator=(const StudyRanks&) = delete;

  bool is_leader() const;  ///< returns whether this is rank 0
  /// Rank 0: runs all trials that are missing in the database. Throws Error if the workers have another study.
  StudyProgress run_leader(StudyDatabase& database, const StudyRunOptions& options);
  int lost_workers() const;  ///< number of workers that rank 0 gave up
  /// Workers: run the trials that rank 0 assigns, until there are no more.
  void run_worker(const Study& study);
  /// Terminates the processes of all ranks with this exit status.
  [[noreturn]] void abandon(int status);

 private:
  struct Impl;
  explicit StudyRanks(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem
