#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <tandem/studies/study/study.hpp>
#include <tandem/studies/study/trial_metrics.hpp>

namespace tandem {

/// The SQLite file of a study's folder: the study, and a row a finished trial. Each row is a transaction, on the disk
/// before add() returns. One process writes at a time; any may read. Throws Error, naming the file, where it is
/// damaged, locked, of another study, or the disk is full.
class StudyDatabase {
 public:
  static constexpr const char* file_name = "study.sqlite";

  /// Makes the folder's database; it must have none. Room on the disk for all trials is taken at once.
  static StudyDatabase create(const std::filesystem::path& folder, const Study& study, const std::string& yaml);
  /// For more trials of this study. Throws Error when the database is of another one.
  static StudyDatabase resume(const std::filesystem::path& folder, const Study& study);
  static StudyDatabase read(const std::filesystem::path& folder);
  static bool is_in(const std::filesystem::path& folder);

  StudyDatabase(StudyDatabase&&) noexcept;
  ~StudyDatabase();

  const Study& study() const;
  const std::string& yaml() const;  ///< the study's file as it was

  /// A trial that is there already is left as it is.
  void add(const TrialResult& result);
  void add_all(const std::vector<TrialResult>& results);  ///< in one transaction
  std::vector<bool> finished() const;                     ///< of each trial, whether it is there
  std::size_t count() const;
  std::vector<TrialResult> results() const;  ///< by number

 private:
  struct Impl;
  explicit StudyDatabase(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem
