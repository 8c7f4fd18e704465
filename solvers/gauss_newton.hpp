#pragma once

#include <tandem/solvers/levenberg_marquardt.hpp>

namespace tandem {

/// Levenberg–Marquardt on a sparse Cholesky factorisation, for problems without hard constraints, with the curvature
/// that Gauss-Newton leaves out learned from the last few steps (solvers/secant.hpp).
struct GaussNewtonOptions : LevenbergMarquardtOptions {};

/// Empty, or a sentence that says why this solver cannot take the problem.
std::string why_unsupported(const Problem& problem, const GaussNewtonOptions& options);
/// Leaves the best point found in the problem's variables, whatever the status; `unsupported` where why_unsupported().
Summary solve(Problem& problem, const GaussNewtonOptions& options);

}  // namespace tandem
