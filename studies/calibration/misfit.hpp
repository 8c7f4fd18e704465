#pragma once

#include <string>
#include <vector>

#include <tandem/problem/stop.hpp>
#include <tandem/solvers/residual_series.hpp>
#include <tandem/studies/calibration/calibration_problem.hpp>

namespace tandem {

/// Standardised residuals of one component of a sensor at the solution of a problem. Measurements with a robust weight
/// below kDownweightThreshold are omitted.
struct Misfit : ResidualSeries {
  std::string scenario, parameter;  ///< "usbl.x"
  std::string component;            ///< "x"
  bool angle = false;               ///< the component is an angle
  int down_weighted = 0;            ///< number of omitted measurements

  /// Returns a sentence that names deviations from white noise and model terms that may explain them. Empty if there
  /// are none.
  std::string diagnosis() const;
};

/// Autocorrelation of a parameter over all scenarios, at lags 0, 1, … in measurements. Ends before the first lag with
/// less than ten pairs.
struct Autocorrelation {
  std::string parameter;
  std::vector<double> values;
};
/// Returns the autocorrelations up to `lags`, in the order in which parameters first appear.
std::vector<Autocorrelation> autocorrelations(const std::vector<Misfit>& misfits, std::size_t lags);

/// Returns the misfits of all sensors at the current values and noise. Throws Error if the problem has no covariances,
/// and Stopped.
std::vector<Misfit> misfits(CalibrationProblem& problem, const Stop& stop = {});

}  // namespace tandem
