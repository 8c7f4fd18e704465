#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <tandem/studies/study/study_tables.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// A column of the table of means.
struct StudyColumn {
  const char *metric, *raw;  ///< raw: metric of the raw measurements, or null
  const char* head;
  int decimals;
};
/// Returns the columns for which the study has values.
std::vector<StudyColumn> study_columns(const StudyTables& tables);
/// Returns a sentence that explains the table of means.
std::string study_columns_text(const Study& study);
/// Returns a mean as "1.572 ± 0.120", a share as "95 % (88 … 98)", nullptr as a dash.
std::string mean_text(const StudyColumn& column, const Interval* mean);

/// Returns the report for a terminal and tables.txt: means with the half width of their 95 % confidence intervals,
/// paired comparisons, consistency. The text depends only on the trials.
std::string study_report(const Study& study, const StudyTables& tables);
/// Returns the table of computing times.
std::string study_timing(const StudyTables& tables);

/// Writes tables.txt, summary.csv, pairs.csv, consistency.csv and timing.csv, which alone depends on the machine.
void write_study_tables(const Study& study, const StudyTables& tables, const std::filesystem::path& folder);

/// Returns the content of trials.csv: a row per trial with its grid values and metrics.
std::string trials_csv(const Study& study, const std::vector<TrialResult>& results);

/// Returns the columns of all CSV files of a study.
std::vector<FileDescription> study_file_columns();

}  // namespace tandem
