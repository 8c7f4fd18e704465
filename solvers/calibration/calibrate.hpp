#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <tandem/problem/stop.hpp>
#include <tandem/solvers/calibration/noise_group.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// A residual block that holds a measurement, as opposed to a prior or a motion model.
struct MeasuredBlock {
  Block block;
  int problem = 0;  ///< index of its problem among those that are calibrated together
};

struct CalibrationOptions {
  int max_iterations = 50;
  double tolerance = 1e-3;  ///< Stops when each step of a log factor is smaller.
  double max_factor = 1e3;  ///< Factors are confined to [1 / max_factor, max_factor].
  bool ranges = true;       ///< False: skips standard errors, evidence ranges and the identifiability test.
  int profile_points = 0;   ///< Number of points of CalibratedNoise::profile; needs `ranges`.
  Stop stop{};              ///< Ends the calibration with the best factors so far, also within a solve.
  /// Initial log factors, one per group; requires counted_rows. Empty: starts at zero, the given noise.
  Eigen::VectorXd initial_log_factors{};
  /// Fixed value of Calibration::counted_rows, one per group. Empty: computed.
  Eigen::VectorXd counted_rows{};
  /// The measurements. All other soft blocks are priors on the states. Priors may overlap (a level target that also
  /// rotates slowly), so their product is not normalised. The evidence is therefore divided by the integral of the
  /// priors. That integral is computed with the measurements at 1e-6 of their given information, which keeps it finite
  /// (fractional Bayes factor, O'Hagan 1995) and independent of the measurements' factors. Empty: every block is a
  /// measurement or, like a motion model, a normalised density.
  std::vector<MeasuredBlock> measured;
  /// Computes the integral of the priors more accurately, so that log_evidence can be compared between problems
  /// (calibrate_built()). The measurements keep 1e-16 of their given information, and a Newton step from the solution
  /// gives the minimal prior cost. With hard constraints, that cost is omitted.
  bool absolute_evidence = false;
  /// Solves a problem, starting at the current values of its variables. Reports failure by a status that is not
  /// converged, or throws Error. Default: gauss_newton, or augmented_lagrangian if there are hard blocks. The problem is
  /// a copy of the caller's: block handles and IDs are valid in it, and Problem::counterpart() returns its variables.
  std::function<Summary(Problem&)> solve;
  /// Called after each iteration with the factors (one per group) and the gain in log evidence over the given noise.
  std::function<void(int iteration, const Eigen::VectorXd& factors, double gain)> progress;
};

/// The calibrated factor of one noise group.
///
/// A factor that is neither identifiable nor bounded keeps the given value, 1. "Evidence" below is the profile evidence
/// of the data alone (without the prior). Only this factor varies; the others stay at their estimates.
struct CalibratedNoise {
  std::string name;
  double factor = 1;     ///< scales the given standard deviations
  double log_error = 0;  ///< standard error of log(factor), about the relative standard error of the factor
  /// The evidence falls on both sides of the estimate. At the final estimate it still does so, or the data constrain
  /// the factor at least as well as the prior does.
  bool identifiable = false;
  /// The evidence falls on one side only and excludes the given value; the prior limits the other side.
  bool bounded = false;
  bool at_limit = false;  ///< the factor reached CalibrationOptions::max_factor or its inverse
  /// Range of factors over which the log evidence stays within 2 of its maximum. A side on which it does not fall ends
  /// at 10 times the estimate (or a tenth), or at the last factor for which the problems could be solved.
  double flat_from = 1, flat_to = 1;
  double gain = 0;  ///< increase of the log evidence from the given factor to the estimate
  /// Profile evidence: factors around the estimate, and the log evidence there minus that at the estimate.
  std::vector<std::pair<double, double>> profile;
  double rows = 0;            ///< number of residual rows in the group
  double effective_rows = 0;  ///< degrees of freedom left after the states are estimated
};

struct Calibration {
  Status status = Status::failed;
  std::string message;                 ///< One sentence.
  std::vector<CalibratedNoise> noise;  ///< In the order of the groups.
  Eigen::MatrixXd log_covariance;      ///< Posterior covariance of the log factors; zero for factors kept as given.
  double gain = 0;                     ///< Increase of the log evidence over the given noise.
  /// Includes the priors of the factors, excludes log_constants() of the given problems.
  double log_evidence = 0;
  /// Copies of the problems with the calibrated noise, solved; after a stop, not necessarily solved. Block handles are
  /// valid in them, and Problem::counterpart() returns their variables. apply() brings the result to other problems.
  std::vector<std::shared_ptr<Problem>> problems;
  /// Number of rows of each group that the robust losses count (tandem::counted_rows).
  Eigen::VectorXd counted_rows;
  int iterations = 0, solves = 0;

  bool converged() const { return status == Status::converged; }
};

/// Estimates the factors θ on the standard deviations of groups of residual rows by maximising the marginal likelihood
/// (evidence) in Laplace's approximation (Tierney & Kadane 1986; MacKay 1992, "Bayesian interpolation"),
///
///   log p(z | θ) ≈ −F(x*(θ); θ) − ½ log det H(x*(θ); θ) + Σ log det W(θ) − log Z(θ) + log p(θ).
///
/// - F is the cost, x* its minimum and H the Gauss-Newton Hessian at x*, confined to the hard equalities if there are
///   any.
/// - W whitens a block. Robust losses weight H by ρ′. The term log det W counts only counted_rows(), so outliers do not
///   inflate θ.
/// - Z is the integral of the priors on the states (CalibrationOptions::measured), and p(θ) the prior of the factors.
///
/// Without a robust loss, the derivative by the log factor of a group is Σ (r² + J Σ Jᵀ) − n over its whitened rows.
/// Here n is the number of counted rows, and Σ the selected inverse of H. Robust losses add the change of their weights
/// ρ′ in H, directly and through x* (detail::LossTerms). The change of the Jacobians J with x* is neglected.
///
/// Student's t: H has the expected curvature of the measured blocks. The evidence and its derivative include the first
/// correction for the tails (detail::TailTerm), unless there are hard constraints.
///
/// Steps are Newton steps with the average information (Gilmour, Thompson & Cullis 1995), or quasi-Newton steps with
/// hard constraints. Each step is halved until the evidence grows. If it does not, the status is `failed`, unless the
/// gradient promises less than 0.01 nats. Standard errors come from differences of the derivative. Groups must not share
/// rows.
///
/// Works on copies, so the given problems do not change; see Calibration::problems. If stopped, returns the best factors
/// so far, without standard errors. Throws Error if
/// - there is no problem or no group, or a group has no rows;
/// - a row does not exist, is in two groups or belongs to a hard block;
/// - a measured student_t loss is not a density (degrees_of_freedom());
/// - a problem cannot be solved with the given noise, or with any noise near an iterate.
Calibration calibrate(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                      const CalibrationOptions& options = {});
inline Calibration calibrate(Problem& problem, const std::vector<NoiseGroup>& groups,
                             const CalibrationOptions& options = {}) {
  Problem* const one[] = {&problem};
  return calibrate(std::span<Problem* const>(one), groups, options);
}

/// Sets the noise of the groups, the values of all variables and the multipliers to those of Calibration::problems. The
/// problems and groups are those that were calibrated, or copies of them.
void apply(const Calibration& found, std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups);
inline void apply(const Calibration& found, Problem& problem, const std::vector<NoiseGroup>& groups) {
  Problem* const one[] = {&problem};
  apply(found, std::span<Problem* const>(one), groups);
}

}  // namespace tandem
