#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <tandem/solvers/calibration/calibrate.hpp>

namespace tandem {

/// A positive number that problems are built by, and residuals and noise depend on otherwise than by a factor on a standard
/// deviation: a time constant, degrees of freedom.
struct BuiltParameter {
  std::string name;
  double given;                       ///< above zero
  double prior = 1.0;                 ///< standard deviation of its logarithm around that of `given`; 0: no prior
  double least = 0, most = HUGE_VAL;  ///< never beyond these, nor a factor of CalibrationOptions::most from `given`
};

/// Problems as they are built by some values of the parameters.
struct BuiltProblems {
  std::vector<std::shared_ptr<Problem>> problems;  ///< each may be part of what it shares ownership with
  std::vector<NoiseGroup> groups;                  ///< in the same order whatever the values; none: all noise is known
  std::vector<MeasuredBlock> measured;             ///< CalibrationOptions::measured
};
using BuildProblems = std::function<BuiltProblems(const Eigen::VectorXd& values)>;

/// What was found of parameters and of noise.
struct BuiltCalibration {
  Status status = Status::failed;
  std::string message;                      ///< one sentence
  std::vector<CalibratedNoise> parameters;  ///< in their order: factors on what was given; without rows
  Eigen::MatrixXd log_covariance;           ///< of the parameters' logarithms; zero where not determined
  Calibration noise;       ///< beside the parameters as found; standard errors include what these are unsure of
  Eigen::VectorXd values;  ///< of the parameters
  double gain = 0;         ///< in the logarithm of the evidence, by parameters and noise
  int iterations = 0;      ///< steps of the parameters
  int builds = 0;          ///< how often all problems were built, also to no avail
  int solves = 0;          ///< of a problem each, by all calibrations and evaluations of the evidence

  bool converged() const { return status == Status::converged; }
};

/// Finds parameters, and beside them the factors on the noise, by the evidence: a maximisation over the parameters' logarithms
/// of the greatest evidence that calibrate() finds beside them, each from the factors and states of the last. That evidence is
/// absolute, log_constants() included: problems that are built by different values compare. Robust losses count rows as at the
/// values given. Steps are quasi-Newton's (BFGS), by differences of the evidence at those factors, which are its
/// derivatives there (the envelope theorem); standard errors by differences of these. A parameter that the data do not tell keeps what
/// was given (CalibratedNoise); so it is where its range ends because there are no problems beyond, not by the data. Where the
/// evidence still grows towards those, the status is `failed` and the message names the parameters and where they were left.
///
/// `build` is called for each value; what it returns is let go before long. Throws Error where that fails at the given values, and as
/// calibrate() does. `options.measured`, `start` and `counted_rows` are not read. Stopped, it gives the best so far.
BuiltCalibration calibrate_built(const BuildProblems& build, const std::vector<BuiltParameter>& parameters,
                                 const CalibrationOptions& options = {});

namespace detail {

/// Variables take the values of those of another problem, built alike by other numbers. Those of groups that have not as many
/// there keep theirs, and those of groups that no recording's problem has.
void take_values(const Problem& from, Problem& to);

}  // namespace detail
}  // namespace tandem
