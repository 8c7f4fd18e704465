#pragma once

#include <string>
#include <vector>

#include <tandem/studies/online/track_records.hpp>
#include <tandem/studies/scenario/frame.hpp>
#include <tandem/studies/support/file_description.hpp>

namespace tandem {

/// Returns an update as one line of JSON, with a line end, in the frame of the scenario. `sensors` are the names of the
/// sensors in the record's health, `ahead` the prediction horizons [s].
std::string track_json_line(const TrackRecord& record, const Frame& frame, const std::vector<std::string>& sensors,
                            const std::vector<double>& ahead);
/// Returns the keys of these lines.
FileDescription track_json_line_keys();

}  // namespace tandem
