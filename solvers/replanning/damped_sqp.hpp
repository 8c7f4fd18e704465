#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include <tandem/problem/problem.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// Sequential quadratic programming that converges from near a solution in a few milliseconds.
///
/// Each quadratic program has the Gauss-Newton Hessian. It is solved by the semismooth Newton iteration of the
/// augmented Lagrangian, which is elastic: contradictory linearised constraints still give a step. Gauss-Newton
/// neglects the curvature of the constraints, with which undamped steps may diverge. The first steps are therefore
/// lightly damped, and later ones more, the less the violation decreases. If they do not converge, the curvature is
/// evaluated and kept for a few steps. Only a part of it is used where the full Hessian is not positive definite.
///
/// A filter line search ensures global convergence (solvers/replanning/filter.hpp). It accepts a full step, a
/// second-order correction, or a part of a step. If it accepts none, the damping grows; finally a restoration reduces
/// the violation alone. The problem is analysed once, for all solves. Iterations and trial steps are bounded.
///
/// Sources: Diehl et al. 2005, real-time iterations; Wright 1998, stabilised SQP; Wächter & Biegler 2006, filter and
/// restoration.
///
/// Different problems may be solved concurrently.
class DampedSqp {
 public:
  struct Options {
    /// Largest violation of a solution, in the units of the rows. Rows of large terms are met up to their rounding.
    double feasible = 5e-7;
    double cost_tolerance = 1e-4;  ///< predicted decrease of the cost, relative to 1 + cost, at convergence
    int patience = 20;             ///< iterations after which any feasible point is accepted
    int max_iterations = 40;
    double time_limit = std::numeric_limits<double>::infinity();  ///< [s]
    /// Starts from the multipliers of the hard blocks (Problem::multipliers), where each solve stores its own. The
    /// curvature of the constraints is then used from the first step on.
    bool from_multipliers = false;
    const std::atomic<bool>* stop = nullptr;  ///< ends the solve at the best iterate once true; any thread may set it
    /// Called once per iteration, while the variables have the values of the iterate; see SolverOptions::progress.
    std::function<void(const Progress&)> progress;
  };

  /// The problem must outlive this object, and must keep its variables and blocks.
  explicit DampedSqp(Problem& problem);
  ~DampedSqp();

  /// Solves the problem from the values of its variables, which get the result. The status is
  ///
  /// - `converged`: a solution.
  /// - `max_iterations`, `time_limit` or `interrupted`: the best iterate, feasible if max_violation ≤ `feasible`.
  /// - `infeasible`: no small step reduces the violation.
  /// - `failed`: the last iterate, after a numerical failure.
  Summary solve(const Options& options);

 private:
  struct Analysed;
  class Loop;
  Problem& problem_;
  std::unique_ptr<Analysed> analysed_;
};

}  // namespace tandem
