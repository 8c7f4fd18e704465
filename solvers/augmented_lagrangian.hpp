#pragma once

#include <tandem/solvers/levenberg_marquardt.hpp>

namespace tandem {

/// Primal-dual augmented Lagrangian method for hard equalities and inequalities.
///
/// For large problems it is several times faster than Ipopt. Without hard constraints it equals gauss-newton.
///
/// Each step minimises the Gauss-Newton model of the augmented Lagrangian, a convex piecewise quadratic. A semismooth
/// Newton iteration finds the active rows. The multipliers at the minimum are the next ones, as in stabilised SQP. Near
/// a solution, the method thus converges like Gauss-Newton, for any penalty. The augmented Lagrangian is also the merit
/// function of the damping. Multipliers that increase the residual of the optimality conditions are rejected.
///
/// Sources: Gill & Robinson 2012, A primal-dual augmented Lagrangian, §4; Jallet et al. 2023, ProxDDP, §III; Qi & Sun
/// 1993, A nonsmooth version of Newton's method.
struct AugmentedLagrangianOptions : LevenbergMarquardtOptions {
  double initial_penalty = 10;  ///< weight of a constraint over the stiffness of the cost along it
};

/// Returns the reason why this solver does not support the problem, or "". Throws Error if an option is invalid.
std::string why_unsupported(const Problem& problem, const AugmentedLagrangianOptions& options);
/// Solves the problem; its variables get the best point found. If why_unsupported() gives a reason, the status is
/// `unsupported`.
Summary solve(Problem& problem, const AugmentedLagrangianOptions& options);

}  // namespace tandem
