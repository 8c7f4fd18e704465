#pragma once

#include <utility>
#include <vector>

#include <tandem/studies/navigation/navigate.hpp>
#include <tandem/studies/simulation/simulate_dive.hpp>

namespace tandem {

/// Squared errors of an estimate of the chaser's in units of its covariance (NEES): of a consistent estimate, each is χ²
/// distributed with as many degrees of freedom as it has rows.
/// Source: Bar-Shalom, Li & Kirubarajan 2001, "Estimation with Applications to Tracking and Navigation", §5.4.2.
struct EgoNees {
  double pose = 0;      ///< 6 rows: right perturbations [m, rad]
  double velocity = 0;  ///< 3
  double bias = 0;      ///< 6
};

/// Truth and estimate at one instant.
EgoNees nees(const SE23& truth, const Vector<6>& true_bias, const EgoState& state, const EgoCovariance& covariance);

/// Of the newest keyframe of fixed-lag smoothing (OnlineEstimator, `window` s) of a simulated dive, at each of the
/// instants [s], which are in time order and at keyframes. Throws Error when one is not reached.
std::vector<EgoNees> nees_of_fixed_lag(const SimulatedDive& dive, const std::vector<double>& instants, double window);

/// Where the mean over n independent χ² numbers of so many degrees of freedom is with a probability of 95 %.
std::pair<double, double> chi_squared_band(int degrees, int n);

}  // namespace tandem
