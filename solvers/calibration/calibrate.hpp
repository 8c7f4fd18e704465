#pragma once

#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <tandem/problem/stop.hpp>
#include <tandem/solvers/calibration/noise_group.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

struct MeasuredBlock {
  Block block;
  int problem = 0;  ///< of the problems that are calibrated together
};

struct CalibrationOptions {
  int max_iterations = 50;
  double tolerance = 1e-3;  ///< of each factor's logarithm: smaller steps end it
  double most = 1e3;        ///< no factor leaves [1 / most, most]
  bool ranges = true;       ///< false: factors alone, without standard errors or what the data do not determine
  int profile = 0;          ///< points of CalibratedNoise::profile, where `ranges`
  Stop stop{};              ///< ends it at the best factors so far, also within a solve
  /// Logarithms of factors to begin at, where they are known about, with counted_rows; empty: as given.
  Eigen::VectorXd start{};
  /// What the rows of each group count for under their losses (Calibration::counted_rows), where that is to stay; empty: found.
  Eigen::VectorXd counted_rows{};
  /// What was measured. All other soft blocks are beliefs about the states, which may say one thing twice (a level target that
  /// also turns little) and then are no density of so many rows: their own integral is divided by. It is found with the
  /// measurements at a millionth of their information, so that it exists (fractional Bayes factors, O'Hagan 1995). Empty:
  /// every row is a datum or, as in a chain of motion, a density.
  std::vector<MeasuredBlock> measured;
  /// That integral as it is: with what is measured at 1e-10 of its information and no more, and with the integrand's greatest
  /// value, by a Newton step from the solution. For evidence that compares between problems (calibrate_built()); under hard
  /// constraints without that value.
  bool whole_integral = false;
  /// Solves a problem from its variables' values, which it leaves at the solution; throws Error, or reports a status that
  /// is not converged, where it cannot. gauss_newton without one, or augmented_lagrangian where there are hard blocks.
  std::function<Summary(Problem&)> solve;
  /// Called once an iteration: factors in the groups' order, and the logarithm of the evidence, above that of the start.
  std::function<void(int iteration, const Eigen::VectorXd& factors, double gain)> progress;
};

/// What was found of a group.
struct CalibratedNoise {
  std::string name;
  double factor = 1;     ///< on the standard deviations as they were given
  double log_error = 0;  ///< standard error of its logarithm, about that of the factor itself where it is small
  /// By the data, beside the others as found: their evidence falls to both sides, and does so still where all is found, or they
  /// tell the factor at least as well as its prior does then.
  bool determined = false;
  bool bounded = false;  ///< by the data from one side alone, which excludes what was given; what its prior makes of it
  bool at_bound = false;  ///< it came to the end of what was allowed, `most`
  // None of these: it keeps what was given.
  /// Factors between which the evidence of the data alone falls by less than 2 from its most, the others as found; where no
  /// such factor ends it, 10 times from the one found, or as far as the problems can be solved.
  double flat_from = 1, flat_to = 1;
  double gain = 0;  ///< in the logarithm of the evidence, by this factor alone, against what was given
  /// Factors around the one found, and the logarithm of the data's evidence there against it, the others as found.
  std::vector<std::pair<double, double>> profile;
  double rows = 0, effective_rows = 0;  ///< how many, and what is left when states have taken their share
};

struct Calibration {
  Status status = Status::failed;
  std::string message;                 ///< one sentence
  std::vector<CalibratedNoise> noise;  ///< in the groups' order
  Eigen::MatrixXd log_covariance;      ///< of the factors' logarithms; zero where not determined
  double gain = 0;                     ///< in the logarithm of the evidence
  double log_evidence = 0;             ///< with the priors, but for log_constants() of the problems as given
  Eigen::VectorXd counted_rows;        ///< of each group, under the losses
  int iterations = 0, solves = 0;

  bool converged() const { return status == Status::converged; }
};

/// Finds the factors θ on the standard deviations of groups of rows by maximising the Laplace approximation of the data's
/// evidence (MacKay 1992, "Bayesian interpolation", for factors; Tierney & Kadane 1986 for the approximation),
///
///   log p(z | θ) ≈ −F(x*(θ); θ) − ½ log det H(x*(θ); θ) + Σ log det W(θ) − log Z(θ) + log p(θ),
///
/// F the cost, x* its minimum, Z the integral of what is no measurement (CalibrationOptions::measured), H the Gauss-Newton
/// Hessian there, under hard equalities confined to them; robust losses by their weights ρ′, and log det W by what their rows
/// count for (counted_rows), so that outliers do not count as noise. Its derivative by log θ of a group,
///
///   Σ ρ′ (r² + (J Σ Jᵀ)) − n   over the group's n whitened rows, as losses count them,
///
/// is what EM makes zero, with the selected inverse's blocks Σ. Of what is measured under Student's t, H has the curvature that is
/// to be expected, and log p and its derivative what Laplace's approximation leaves out of the tails (detail::TailTerm), but under
/// hard constraints. Steps are Newton's by the average information (Gilmour,
/// Thompson & Cullis 1995), under hard constraints quasi-Newton's, halved until the evidence grows. Standard errors are by
/// differences of the derivative. The problems are left solved, with the noise that was found. Groups must not share rows.
///
/// Throws Error on a measured student_t that is no density (degrees_of_freedom()), a group without rows, rows that are not there or in two groups, a hard block, no problem or group,
/// or a problem that cannot be solved as it is given, or by any noise near that on the way up. Stopped, it gives the best factors so far, without their errors.
Calibration calibrate(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                      const CalibrationOptions& options = {});
inline Calibration calibrate(Problem& problem, const std::vector<NoiseGroup>& groups,
                             const CalibrationOptions& options = {}) {
  Problem* const one[] = {&problem};
  return calibrate(std::span<Problem* const>(one), groups, options);
}

}  // namespace tandem
