#pragma once

#include <string>

#include <tandem/studies/study/trial_metrics.hpp>

namespace tandem {

/// Serialises a result for another process of the same program. Numbers are exact.
std::string serialized(const TrialResult& result);
/// Deserialises a result. Throws Error if the bytes have the wrong length.
TrialResult deserialized(const std::string& bytes);

}  // namespace tandem
