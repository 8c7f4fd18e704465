#pragma once

#include <optional>

namespace tandem {

/// Returns the processor time of all threads of this process [s]. It excludes the time that other processes used.
double processor_seconds();
/// Returns the processor time of the calling thread [s].
double thread_seconds();

/// Returns the resident memory of this process [MB], or nothing on systems without /proc/self/statm.
std::optional<double> resident_megabytes();

}  // namespace tandem
