#pragma once

#include <string>
#include <vector>

#include <tandem/problem/stop.hpp>
#include <tandem/studies/calibration/calibration_problem.hpp>

namespace tandem {

/// A component of a sensor's residuals at a problem's solution, each divided by the standard deviation that it should
/// have there, its noise less what the states have taken up: of mean 0 and spread 1 and independent if all is right.
struct Misfit {
  std::string scenario, parameter;  ///< "usbl.x"
  std::string component;            ///< "x"
  bool angle = false;               ///< it is one
  std::vector<double> t,
      value;  ///< in time order; those that a robust loss leaves a weight below kDownWeighted are out
  int down_weighted = 0;

  double mean() const;
  double spread() const;       ///< root mean square about the mean
  double correlation() const;  ///< of neighbours
  double spacing() const;      ///< s, median between neighbours
  /// With neighbours' correlation ρ = exp(−spacing / τ), τ [s]; 0 where ρ is not above what independent ones may show.
  double correlation_time() const;
  bool mean_is_off() const;  ///< by more than three of its standard errors, at that correlation
  /// What noise cannot explain, and which term of the model would: a sentence, or nothing.
  std::string diagnosis() const;
};

/// Correlation of each parameter's values so many neighbours apart, from 0 to `lags`, or as long as there are ten pairs,
/// over all scenarios; in the order of the first one's parameters.
struct Autocorrelation {
  std::string parameter;
  std::vector<double> values;
};
std::vector<Autocorrelation> autocorrelations(const std::vector<Misfit>& misfits, std::size_t lags);

/// Of all measurements of a problem, at its values and noise. Throws Error where there are no covariances, and Stopped when
/// it is to stop.
std::vector<Misfit> misfits(CalibrationProblem& problem, const Stop& stop = {});

}  // namespace tandem
