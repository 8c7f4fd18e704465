#pragma once

#include <tandem/solvers/levenberg_marquardt.hpp>

namespace tandem {

/// Hard constraints, equalities and inequalities, by a primal-dual augmented Lagrangian on gauss-newton's steps: for
/// large problems several times faster than Ipopt, at the same optimum. Without hard constraints it is gauss-newton.
///
/// One step minimises the augmented Lagrangian's Gauss-Newton model, a convex piecewise quadratic whose active rows a
/// semismooth Newton iteration finds, and the multipliers at its minimum are the next ones, as in stabilised SQP: near
/// a solution that converges as fast as Gauss-Newton does, whatever the penalty. The augmented Lagrangian itself is the
/// merit by which steps are damped, and multipliers that lead away from the optimality conditions are not taken.
/// Sources: Gill & Robinson 2012, A primal-dual augmented Lagrangian, §4; Jallet et al. 2023, ProxDDP, §III;
/// Qi & Sun 1993, A nonsmooth version of Newton's method.
struct AugmentedLagrangianOptions : LevenbergMarquardtOptions {
  double initial_penalty = 10;  ///< weight of a constraint over the cost's own stiffness along it
};

/// Empty, or a sentence that says why this solver cannot take the problem.
std::string why_unsupported(const Problem& problem, const AugmentedLagrangianOptions& options);
/// Leaves the best point found in the problem's variables, whatever the status; `unsupported` where why_unsupported().
Summary solve(Problem& problem, const AugmentedLagrangianOptions& options);

}  // namespace tandem
