#pragma once

#include <string>

#include <tandem/studies/study/study_tables.hpp>
#include <tandem/studies/support/file_description.hpp>

namespace tandem {

/// Returns one sentence: which model or solver has the least mean of the ranking metric, or the range of the means if
/// there is one.
std::string study_conclusion(const Study& study, const StudyTables& tables);

/// Returns a summary for a terminal of less than 60 lines: a conclusion, the most informative means, the strongest
/// differences between models, the consistency verdicts and the computing times. study_report() has everything.
std::string study_summary(const Study& study, const StudyTables& tables);

/// Returns the tables as a JSON document. `folder` is that of the study.
std::string study_json(const Study& study, const StudyTables& tables, const std::string& folder);
/// Returns the keys of that document.
FileDescription study_json_keys();

}  // namespace tandem
