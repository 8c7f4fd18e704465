#pragma once

#include <atomic>

namespace tandem::testing {

/// What the heap was asked for, in executables one source of which includes allocations.hpp.
inline std::atomic<long> allocations{0};

}  // namespace tandem::testing
