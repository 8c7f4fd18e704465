#pragma once

#include <functional>
#include <optional>
#include <string>

#include <tandem/studies/navigation/navigate.hpp>

namespace tandem {

/// Maximum-likelihood estimate of a sensor's delay relative to the other sensors.
struct DelayFit {
  std::string sensor;
  double delay = 0;                  ///< a measurement stamped t was valid at t − delay [s]
  double cost_before = 0, cost = 0;  ///< cost with the given delay, and with this one
  /// Standard deviation from the curvature of the cost [s]. Absent if the minimum is at or next to an end of the search
  /// range, or if a solve with a neighbouring delay does not converge.
  std::optional<double> sigma{};
  int solves = 0;  ///< number of solves
};

/// Receives "delay of usbl: solve 7, at 0.400 s" before each solve of a fit.
using DelayFitProgress = std::function<void(const std::string&)>;
/// Calls `progress`, if it is set, before solve number `solve` [from 1] with this delay [s].
void report_delay_solve(const DelayFitProgress& progress, const std::string& sensor, int solve, double delay);

/// Returns a sentence about the result, for a report.
std::string text(const DelayFit& fit);

/// Fits the delay of one of the chaser's own sensors by navigating with different delays: 0 to 1 s with a resolution of
/// 5 ms, or, for the IMU, −0.1 to 0.1 s around its given delay with a resolution of 1 ms.
///
/// All delays are compared on the same measurements; those that some delay shifts out of the recording are discarded.
/// Throws Error like navigate(), and if there is no such sensor. Throws Stopped at the solver's time limit, which
/// covers all navigations.
DelayFit fit_delay(const NavigationData& data, const std::string& sensor, const NavigationOptions& options = {},
                   const DelayFitProgress& progress = {});

/// Sets the delay of one of the chaser's own sensors or of the IMU [s].
void set_delay(NavigationData& data, const std::string& sensor, double delay);

}  // namespace tandem
