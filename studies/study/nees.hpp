#pragma once

#include <utility>
#include <vector>

#include <tandem/studies/navigation/navigate.hpp>
#include <tandem/studies/simulation/simulate_dive.hpp>

namespace tandem {

/// Normalised estimation error squared (NEES) of a chaser state. For a consistent estimate each value is χ²
/// distributed, with as many degrees of freedom as rows.
/// Source: Bar-Shalom, Li & Kirubarajan 2001, "Estimation with Applications to Tracking and Navigation", §5.4.2.
struct EgoNees {
  double pose = 0;      ///< 6 rows: right perturbations [m, rad]
  double velocity = 0;  ///< 3
  double bias = 0;      ///< 6
};

/// Returns the NEES of one state. `true_bias`: [accelerometer; gyroscope].
EgoNees nees(const SE23& truth, const Vector<6>& true_bias, const EgoState& state, const EgoCovariance& covariance);

/// Runs fixed-lag smoothing (OnlineEstimator, window [s]) on a simulated dive and returns the NEES of the newest
/// keyframe at each of `instants` [s]. They must be keyframe times in increasing order. Throws Error if one is not
/// reached.
std::vector<EgoNees> nees_of_fixed_lag(const SimulatedDive& dive, const std::vector<double>& instants, double window);

/// Returns the two-sided 95 % interval of the mean of n independent χ² variables with `degrees` degrees of freedom.
std::pair<double, double> chi_squared_band(int degrees, int n);

}  // namespace tandem
