#pragma once

#include <memory>
#include <string>

#include <tandem/problem/problem.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// What gauss-newton and augmented-lagrangian share: Levenberg–Marquardt steps by a sparse Cholesky factorisation, with
/// the curvature that Gauss-Newton leaves out learned from the last few of them (solvers/secant.hpp).
struct LevenbergMarquardtOptions : SolverOptions {
  double cost_tolerance = 1e-10;      ///< relative decrease of the cost below which it has converged
  double gradient_tolerance = 1e-10;  ///< largest gradient entry over the root of its curvature, against √(1 + cost)
  double step_tolerance = 1e-12;      ///< largest entry of a step [m, rad]
  double initial_damping = 1e-5;      ///< of the diagonal, at the first iteration
  int secant_pairs = 8;               ///< past steps to learn curvature from; 0 is plain Levenberg–Marquardt
};

namespace detail {

/// Minimises the cost, and where there are hard constraints the augmented Lagrangian. Patterns, analysis and memory are
/// those of one problem, and serve as long as its variables and blocks stay.
class LevenbergMarquardt {
 public:
  /// `solver` is the name for the summary. Problem and options must live as long.
  LevenbergMarquardt(Problem& problem, const char* solver, const LevenbergMarquardtOptions& options);
  ~LevenbergMarquardt();

  /// False when variables or blocks have joined or left since: it can then solve no more.
  bool is_current() const;
  /// The weights of hard constraints start at `penalty` times the cost's own stiffness.
  Summary solve(double penalty = 0);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};
/// Throws Error when an option is out of its range.
void check(const char* solver, const LevenbergMarquardtOptions& options);

}  // namespace detail
}  // namespace tandem
