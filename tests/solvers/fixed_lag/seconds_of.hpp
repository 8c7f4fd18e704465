#pragma once

#include <tandem/solvers/fixed_lag/fixed_lag_options.hpp>

namespace tandem::testing {

/// Returns the default options with a window of `window` seconds.
inline FixedLagOptions seconds_of(double window) {
  FixedLagOptions options;
  options.window = window;
  return options;
}

}  // namespace tandem::testing
