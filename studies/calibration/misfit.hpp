#pragma once

#include <string>
#include <vector>

#include <tandem/problem/stop.hpp>
#include <tandem/studies/calibration/calibration_problem.hpp>

namespace tandem {

/// Standardised residuals of one component of a sensor at the solution of a problem. Each residual is divided by its
/// expected standard deviation (noise variance minus the variance absorbed by the states). A correct model gives
/// independent values with mean 0 and standard deviation 1.
struct Misfit {
  std::string scenario, parameter;  ///< "usbl.x"
  std::string component;            ///< "x"
  bool angle = false;               ///< the component is an angle
  std::vector<double> t, value;     ///< stamps [s] and standardised residuals in time order
  int down_weighted = 0;            ///< measurements left out of `value`: robust weight below kDownweightThreshold

  double mean() const;
  double spread() const;       ///< standard deviation
  double correlation() const;  ///< autocorrelation at lag 1
  double spacing() const;      ///< median time between successive values [s]
  /// Returns the correlation time τ [s] from correlation() = exp(−spacing / τ), or 0 if the correlation is not
  /// significant.
  double correlation_time() const;
  bool has_significant_mean() const;  ///< more than three standard errors, given the correlation
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
