#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <tandem/solvers/calibration/calibrate.hpp>

namespace tandem {

/// A positive parameter that a problem is built from and that does not just scale a standard deviation: a time
/// constant, or the degrees of freedom of a loss.
struct BuiltParameter {
  std::string name;
  double given;  ///< initial value, positive
  /// Standard deviation of log(value / given) before the data are seen; 0: no prior.
  double prior = 1.0;
  double lower = 0, upper = HUGE_VAL;  ///< bounds, in addition to CalibrationOptions::max_factor
};

/// The problems built from one set of parameter values.
struct BuiltProblems {
  std::vector<std::shared_ptr<Problem>> problems;  ///< may be aliasing pointers into one owner
  std::vector<NoiseGroup> groups;                  ///< same order for all values; empty: the noise is known
  std::vector<MeasuredBlock> measured;             ///< CalibrationOptions::measured
};
using BuildProblems = std::function<BuiltProblems(const Eigen::VectorXd& values)>;

/// Calibrated parameters and noise.
struct BuiltCalibration {
  Status status = Status::failed;
  std::string message;                      ///< One sentence.
  std::vector<CalibratedNoise> parameters;  ///< Factors on the given values; `rows` is unused.
  Eigen::MatrixXd log_covariance;           ///< Posterior covariance of the log parameters; zero if kept.
  Calibration noise;                        ///< At the calibrated parameters; log_error includes their uncertainty.
  Eigen::VectorXd values;                   ///< Calibrated parameters.
  double gain = 0;                          ///< Increase of the log evidence by parameters and noise.
  int iterations = 0;                       ///< Steps of the parameters.
  int builds = 0;                           ///< Number of calls of BuildProblems, including failed ones.
  int solves = 0;                           ///< Number of solves of a single problem.

  bool converged() const { return status == Status::converged; }
};

/// Estimates parameters jointly with the noise factors: maximises over the log parameters the evidence that calibrate()
/// reaches at each of them. Each evaluation starts from the noise factors and the states of the previous one. The
/// evidence is absolute (log_constants()), so it can be compared between problems built from different values. Robust
/// losses keep the counted rows of the given parameters.
///
/// Steps are quasi-Newton steps (BFGS). The gradient comes from differences of the evidence with fixed noise factors
/// (envelope theorem), and standard errors from differences of the gradient. A parameter that is not
/// identifiable keeps the given value (CalibratedNoise). A range that ends because problems cannot be built beyond does
/// not count as bounded by the data. If the evidence still grows towards such an end, the status is `failed`, and the
/// message names the parameters and their values.
///
/// `build` is called for each value, and its problems are released soon after. `options.measured`,
/// `initial_log_factors` and `counted_rows` are ignored. If stopped, returns the best parameters so far.
///
/// At values without a problem, `build` throws NumericalError or another Error. Its BadInputError, StaleHandleError and
/// exceptions of other types propagate. At the given values, every exception propagates. Throws like calibrate().
BuiltCalibration calibrate_built(const BuildProblems& build, const std::vector<BuiltParameter>& parameters,
                                 const CalibrationOptions& options = {});

}  // namespace tandem
