#pragma once

#include <tandem/solvers/online/heading_alignment.hpp>
#include <tandem/solvers/online/online_estimator.hpp>

#include "problem/tracking/level_turn.hpp"

/// Helpers for tests of OnlineEstimator.
namespace tandem::testing {

inline std::string text_of(const std::optional<Rejection>& rejection) { return rejection ? rejection->text : "taken"; }

/// Options that solve each update to convergence.
inline OnlineOptions exactly(double window) {
  OnlineOptions options;
  options.lag.window = window;
  options.lag.max_iterations = 50;
  options.lag.cost_tolerance = 1e-12;
  return options;
}
/// Options that also start at the truth.
inline OnlineOptions exactly(const LevelTurn& turn, double window = 1e3) {
  OnlineOptions options = exactly(window);
  options.start = turn.start();
  return options;
}

/// The data with errors of about one standard deviation.
inline NavigationData noisy(const LevelTurn& turn) {
  NavigationData data = turn.data();
  for (EgoSensor& sensor : data.sensors)
    for (std::size_t i = 0; i < sensor.measurements.size(); ++i)
      sensor.measurements[i].value +=
          sensor.sigma[0] * Vector<3>(std::sin(double(i)), std::cos(3. * double(i)), std::sin(2. + double(i)));
  return data;
}

}  // namespace tandem::testing
