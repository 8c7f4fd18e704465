#pragma once

#include <memory>
#include <string>

#include <tandem/lie/error.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/solvers/persistent_solve.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// Options shared by gauss-newton and augmented-lagrangian. Both take Levenberg–Marquardt steps with a sparse Cholesky
/// factorisation. Secant pairs of the last steps supply the curvature that Gauss-Newton neglects (solvers/secant.hpp).
struct LevenbergMarquardtOptions : SolverOptions {
  double cost_tolerance = 1e-10;  ///< relative decrease of the cost below which the solve converges
  /// Largest gradient entry over the root of its curvature, relative to √(1 + cost).
  double gradient_tolerance = 1e-10;
  double step_tolerance = 1e-12;  ///< largest entry of a step [m, rad]
  double initial_damping = 1e-5;  ///< initial damping, relative to the diagonal of the Hessian
  int secant_pairs = 8;           ///< number of secant pairs; 0 for plain Levenberg–Marquardt
};

namespace detail {

/// Minimises the cost or, with hard constraints, the augmented Lagrangian. The patterns, the symbolic analysis and the
/// memory belong to one problem. They stay valid while the variables and blocks of the problem stay the same.
class LevenbergMarquardt final : public PersistentSolve {
 public:
  /// `solver` is the name in the summary. `penalty` is the initial weight of hard constraints, relative to the
  /// stiffness of the cost; null without hard constraints. The problem, the options and `penalty` must outlive this
  /// object.
  LevenbergMarquardt(Problem& problem, const char* solver, const LevenbergMarquardtOptions& options,
                     const double* penalty = nullptr);
  ~LevenbergMarquardt() override;

  bool is_current() const override;
  Summary solve() override;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  const double* penalty_;
};

/// Throws BadInputError if an option is out of range.
inline void check(const char* solver, const LevenbergMarquardtOptions& options) {
  if (!(options.cost_tolerance >= 0) || !(options.gradient_tolerance >= 0) || !(options.step_tolerance >= 0) ||
      !(options.initial_damping >= 0) || options.secant_pairs < 0)
    throw BadInputError(std::string(solver) + ": tolerances, initial_damping and secant_pairs must not be negative");
}

}  // namespace detail
}  // namespace tandem
