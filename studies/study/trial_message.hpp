#pragma once

#include <string>

#include <tandem/studies/study/trial_metrics.hpp>

namespace tandem {

/// A result as bytes, for another process of the same program: numbers to the last bit.
std::string packed(const TrialResult& result);
/// Throws Error on bytes that packed() has not made.
TrialResult unpacked(const std::string& bytes);

}  // namespace tandem
