#pragma once

#include <optional>

namespace tandem {

/// Processor time of this process so far, all threads [s]: on a machine that is shared, time without what others took.
double processor_seconds();
/// The same of the calling thread alone.
double thread_seconds();

/// Resident memory of this process [MB]; nothing where the system does not tell (no /proc/self/statm).
std::optional<double> resident_megabytes();

}  // namespace tandem
