#pragma once

#include <tandem/solvers/levenberg_marquardt.hpp>

namespace tandem {

/// Levenberg–Marquardt method with a sparse Cholesky factorisation, for problems without hard constraints. Secant pairs
/// of the last steps supply the curvature that Gauss-Newton neglects (solvers/secant.hpp). If they do not suffice near a
/// minimum, and most residuals implement second derivatives, steps use the exact Hessian.
struct GaussNewtonOptions : LevenbergMarquardtOptions {};

/// Returns the reason why this solver does not support the problem, or "". Throws Error if an option is invalid.
std::string why_unsupported(const Problem& problem, const GaussNewtonOptions& options);
/// Solves the problem; its variables get the best point found. If why_unsupported() gives a reason, the status is
/// `unsupported`.
Summary solve(Problem& problem, const GaussNewtonOptions& options);

}  // namespace tandem
