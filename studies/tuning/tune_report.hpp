#pragma once

#include <string>
#include <vector>

#include <tandem/studies/support/file_description.hpp>
#include <tandem/studies/tuning/tune.hpp>

namespace tandem {

/// Returns the table of steps, the selected model, its consistency and what it leaves unexplained. Shows rejected
/// candidates with `full`, else only the best of them.
std::string tune_report(const Tuning& tuning, bool full);
/// Returns the list of candidates of a dry run.
std::string candidates_report(const Tuning& tuning);
/// Returns the selected model in one sentence.
std::string tuned_model(const Tuning& tuning);

std::string tune_json(const Tuning& tuning);
FileDescription tune_json_keys();
std::string steps_csv(const Tuning& tuning);
std::vector<FileDescription> tune_file_columns();

/// Returns the run file with the selected model, which the commands take by --config; `other` are further options.
std::string tuned_run_file(const Tuning& tuning, const std::vector<std::string>& scenarios);

}  // namespace tandem
