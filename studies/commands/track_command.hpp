#pragma once

#include <optional>
#include <string>

#include <tandem/studies/commands/tracking_arguments.hpp>

namespace tandem {

/// The words of `tandem track` as they were typed; nothing where an option was not given.
struct TrackArguments {
  TrackingArguments tracking;
  std::optional<std::string> window, keyframes, iterations, alignment, predict, until, out;
  bool realtime = false, standard_input = false, dvl_scale = false, json = false, quiet = false;
};

/// Tracks line by line, prints, and writes; an interrupt ends it with the summary, a second one the program. Returns 0,
/// or 2 when there was nothing that could be tracked, also when it was interrupted before. Throws Error on wrong input,
/// then nothing is written.
int run_track(const TrackArguments& arguments);

}  // namespace tandem
