#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <tandem/studies/study/study_tables.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

/// A column of the table of means.
struct StudyColumn {
  const char *metric, *raw;  ///< raw: the same of the measurements themselves, or null
  const char* head;
  int decimals;
};
/// Those that a study has anything in.
std::vector<StudyColumn> study_columns(const StudyTables& tables);
/// Whose means they are, a sentence.
std::string study_columns_text(const Study& study);
/// "1.572 ± 0.120"; of a share "95 % (88 … 98)"; a dash for nothing.
std::string mean_text(const StudyColumn& column, const Interval* mean);

/// For a terminal and tables.txt: errors with the half width of their 95 % intervals, comparisons on the same noise,
/// consistency. Bit for bit the same for the same trials.
std::string study_report(const Study& study, const StudyTables& tables);
/// What the trials took, which is the machine's.
std::string study_timing(const StudyTables& tables);

/// tables.txt, summary.csv, pairs.csv, consistency.csv and, not the same on any machine, timing.csv.
void write_study_tables(const Study& study, const StudyTables& tables, const std::filesystem::path& folder);

/// trials.csv: a row a trial with its place in the grid and its numbers.
std::string trials_csv(const Study& study, const std::vector<TrialResult>& results);

/// The columns of all files, for documents.
std::vector<CsvDescription> study_file_columns();

}  // namespace tandem
