#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Core>

#include <tandem/solvers/calibration/calibrate.hpp>

namespace tandem::detail {

// Common parts of the searches of calibrate() and calibrate_built(). Both maximise over log factors, some of them
// fixed.

/// Normal prior of a log factor with mean 0 and standard deviation `sigma`; there is none if `sigma` is 0.
struct LogPrior {
  double sigma;

  /// Returns the log density up to a constant.
  double value(double x) const { return sigma > 0 ? -0.5 * x * x / (sigma * sigma) : 0.0; }
  /// Returns the derivative of value().
  double slope(double x) const { return sigma > 0 ? -x / (sigma * sigma) : 0.0; }
  double information() const { return sigma > 0 ? 1 / (sigma * sigma) : 0.0; }
};

/// Returns the prior standard deviations of noise groups or parameters.
template <class Parameter>
Eigen::VectorXd prior_sigmas(const std::vector<Parameter>& parameters) {
  Eigen::VectorXd sigmas(Eigen::Index(parameters.size()));
  for (Eigen::Index i = 0; i < sigmas.size(); ++i) sigmas[i] = parameters[std::size_t(i)].prior;
  return sigmas;
}

/// Returns the indices of the entries that are equal to `value`.
std::vector<Eigen::Index> indices_of(const std::vector<bool>& flags, bool value);

/// Updates the inverse of a negative Hessian by the BFGS formula. `change` is the decrease of the gradient along the
/// step. Does nothing if the cosine of the angle between both is below `min_cosine`.
void update_inverse(Eigen::MatrixXd& inverse, const Eigen::VectorXd& step, const Eigen::VectorXd& change,
                    double min_cosine);

/// Returns the log factors, within [low, high], at which a profile is evaluated: `points` ones around the flat range.
std::vector<double> profile_grid(const CalibratedNoise& noise, int points, double low, double high);

/// Returns the inverse of a curvature, n × n, with eigenvalues below 1 raised to 1 in units of the prior standard
/// deviations; Standard deviations of 0 are replaced by `no_prior`. The posterior is then never wider than the prior,
/// even where Laplace's approximation gives a wider one.
Eigen::MatrixXd regularized_covariance(Eigen::VectorXd prior_sigma, double no_prior, const Eigen::MatrixXd& curvature);

}  // namespace tandem::detail
