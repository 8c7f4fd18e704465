#pragma once

#include <atomic>

namespace tandem::testing {

/// Number of heap allocations; counted only if one source of the executable includes allocations.hpp.
inline std::atomic<long> allocations{0};

}  // namespace tandem::testing
