#pragma once

#include <string>
#include <vector>

#include <tandem/studies/live/track_records.hpp>
#include <tandem/studies/scenario/frame.hpp>

namespace tandem {

/// What a machine reads while tracking: an update as one line of JSON, with its line end. `sensors`: names of those in the
/// record's health; `ahead`: how far its predictions reach [s]. The keys are in docs/file_formats.md.
std::string track_json_line(const TrackRecord& record, const Frame& frame, const std::vector<std::string>& sensors,
                            const std::vector<double>& ahead);

}  // namespace tandem
