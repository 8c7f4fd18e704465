#pragma once

#include <optional>
#include <string>

#include <tandem/studies/navigation/navigate.hpp>

namespace tandem {

/// The delay of a sensor against the others that explains a recording best, by maximum likelihood.
struct DelayFit {
  std::string sensor;
  double delay = 0;                  ///< s; of the inertial one what its stamps are late by
  double cost_before = 0, cost = 0;  ///< of navigating with the delay as it was, and with this one
  /// s, its standard error by the curvature of the cost; none where the best is at the end of what was
  /// tried or next to it, or where navigating beside it does not converge.
  std::optional<double> deviation{};
  int solves = 0;
};

/// Navigates with delays of 0 to 1 s, to the nearest 5 ms, of one of the chaser's own sensors; of the inertial one, whose
/// stamps may be early as well, of −0.1 to 0.1 s, to the nearest millisecond. Measurements that some of these would put
/// before the recording, or out of its reach, are left out. Throws Error as navigate() and where there is no such
/// sensor, and Stopped at the solver's limits, which are of all this together.
DelayFit fit_delay(const NavigationData& data, const std::string& sensor, const NavigationOptions& options = {});

/// Sets the delay of one of the chaser's own sensors, the inertial one included.
void set_delay(NavigationData& data, const std::string& sensor, double delay);

}  // namespace tandem
