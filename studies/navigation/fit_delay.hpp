#pragma once

#include <string>

#include <tandem/studies/navigation/navigate.hpp>

namespace tandem {

/// The delay of a sensor against the inertial one that explains a recording best, by maximum likelihood.
struct DelayFit {
  std::string sensor;
  double delay = 0;                  ///< s
  double cost_before = 0, cost = 0;  ///< of navigating with the delay as it was, and with this one
  int solves = 0;
};

/// Navigates with delays of up to `most` seconds, to the nearest 5 ms, and without the sensor's first measurements, which
/// some of them would put before the recording. Throws Error as navigate(), and Stopped at the solver's limits, which are
/// of all this together.
DelayFit fit_delay(const NavigationData& data, std::size_t sensor, const NavigationOptions& options = {},
                   double most = 1.0);

}  // namespace tandem
