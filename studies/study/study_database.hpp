#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <tandem/studies/study/study.hpp>
#include <tandem/studies/study/trial_metrics.hpp>

namespace tandem {

/// SQLite file in the folder of a study: the study and one row per finished trial. add() is a transaction: the row is
/// on disk when it returns. One process writes at a time; any process may read. Functions throw Error that names the
/// file if it is damaged, locked or of another study, or if the disk is full.
class StudyDatabase {
 public:
  static constexpr const char* file_name = "study.sqlite";

  /// Creates the database and reserves disk space for all trials. `yaml`: text of the study file. The folder must not
  /// have a database.
  static StudyDatabase create(const std::filesystem::path& folder, const Study& study, const std::string& yaml);
  /// Opens the database for more trials of this study. Throws Error if it belongs to another study.
  static StudyDatabase resume(const std::filesystem::path& folder, const Study& study);
  /// Opens the database for reading.
  static StudyDatabase read(const std::filesystem::path& folder);
  /// Returns whether the folder has a database.
  static bool is_in(const std::filesystem::path& folder);

  StudyDatabase(StudyDatabase&&) noexcept;
  ~StudyDatabase();

  const Study& study() const;
  const std::string& yaml() const;  ///< text of the study file

  /// Adds a trial. An existing result of the same trial is kept.
  void add(const TrialResult& result);
  void add_all(const std::vector<TrialResult>& results);  ///< adds all in one transaction
  std::vector<bool> finished() const;                     ///< per trial, whether its result exists
  std::size_t count() const;                              ///< number of finished trials
  std::vector<TrialResult> results() const;               ///< ordered by trial number

 private:
  struct Impl;
  explicit StudyDatabase(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem
