#pragma once

#include <string>

#include <tandem/studies/import/import.hpp>
#include <tandem/studies/support/file_description.hpp>

namespace tandem {

/// Returns a report: rows read, rows dropped with the reason, assumed values, and suspicious values.
std::string import_report(const Import& import);
std::string import_json(const Import& import, const std::string& folder);
FileDescription import_json_keys();

/// Returns the streams of a recording with their fields, rates and spans (tandem import --list).
std::string stream_list(const Recording& recording);
std::string stream_list_json(const Recording& recording);
FileDescription stream_list_json_keys();

}  // namespace tandem
