#pragma once

#include <memory>

#include <tandem/problem/problem.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// From near a solution to where a plan is good enough: a few sequential quadratic programs with Gauss-Newton's Hessian,
/// each solved by the augmented Lagrangian's semismooth Newton iteration, which is elastic: constraints that contradict
/// each other once linearised still give a step. What Gauss-Newton leaves out, the curvature of the constraints, would make
/// undamped steps diverge; the first ones are nearly free, later ones damped by the cost's own stiffness, the more the less
/// the violation falls. Where that has not converged in a few steps, the curvature is evaluated and kept over the next few,
/// or a part of it where the Hessian is not positive definite with all.
///
/// A filter line search globalises it (solvers/planning/filter.hpp): a step is taken whole, corrected to second order, or
/// in part; where none of it is accepted, damping grows, and then a restoration lessens the violation alone. The program is
/// analysed once, so that the next solve of the same problem only computes. Iterations, and trials within each, are
/// bounded. Source of the scheme: Diehl et al. 2005, real-time iterations; Wright 1998, the stabilised program; Wächter &
/// Biegler 2006, filter and restoration.
class DampedSqp {
 public:
  struct Options {
    double feasible = 5e-7;        ///< largest violation of a solution, in the rows' units
    double cost_tolerance = 1e-4;  ///< foretold decrease, over 1 + cost, below which it has converged
    int patience = 20;             ///< iterations after which any feasible point will do
    int max_iterations = 40;
    double time_limit = std::numeric_limits<double>::infinity();  ///< s
    /// Start from the multipliers that the hard blocks have (Problem::multipliers), which every solve leaves there: the
    /// constraints' curvature is then known from the first step on.
    bool from_multipliers = false;
  };

  /// The problem must live as long, and keep its variables and blocks.
  explicit DampedSqp(Problem& problem);
  ~DampedSqp();

  /// The variables have a solution when converged; with max_iterations or time_limit the best iterate, feasible when
  /// max_violation is within `feasible`; infeasible where no small step lessens the violation; failed, with the last
  /// iterate, where the numerics gave out.
  Summary solve(const Options& options);

 private:
  struct Analysed;
  class Loop;
  Problem& problem_;
  std::unique_ptr<Analysed> analysed_;
};

}  // namespace tandem
