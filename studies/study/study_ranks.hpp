#pragma once

#include <memory>

#include <tandem/studies/study/study_run.hpp>

namespace tandem {

/// The processes that a launcher of MPI (mpirun, srun) has started together: rank 0, which has the database, and workers.
/// Work is handed out trial by trial. Each worker tells every few seconds that it is there; one that has been silent for
/// half a minute is given up, its trial done by another, so that a lost host costs no more than the trials in flight.
class StudyRanks {
 public:
  /// Nothing where this process was started alone. Throws Error where it was not, in a build without MPI.
  static std::unique_ptr<StudyRanks> launched();
  ~StudyRanks();
  StudyRanks(const StudyRanks&) = delete;
  StudyRanks& operator=(const StudyRanks&) = delete;

  bool leads() const;  ///< whether this is rank 0
  /// Does all trials that the database does not have; of rank 0. Throws Error where workers have another study.
  StudyProgress lead(StudyDatabase& database, const StudyRunOptions& options);
  int lost() const;  ///< workers that were given up
  /// Does the trials that rank 0 hands out, until there are no more; of the others.
  void work(const Study& study);
  /// Ends the processes of all ranks, when one cannot go on.
  [[noreturn]] void abandon(int status);

 private:
  struct Impl;
  explicit StudyRanks(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem
