#pragma once

#include <tandem/solvers/online/fixed_lag_options.hpp>

namespace tandem::testing {

/// The default options with a window of so many seconds.
inline FixedLagOptions seconds_of(double window) {
  FixedLagOptions options;
  options.window = window;
  return options;
}

}  // namespace tandem::testing
