#pragma once

#include <Eigen/Core>

#include <tandem/residuals/loss.hpp>

namespace tandem::detail {

/// Correction of the Laplace evidence for one block with a Student's t loss, whose tails are heavier than a Gaussian's:
///
///   log E[t(e) / s(e)],   e ~ N(r, V).
///
/// Here r is the whitened residual at the solution, V its covariance, and t = exp(−½ρ). The Gaussian s replaces t in
/// the Hessian: it has the value and slope of t at r, and the information κ I with κ = ρ′(r²) expected_curvature().
/// This is the first term of the expansion about Laplace's approximation (Opper, Paquet & Winther 2013). As t is a
/// mixture of normal densities over their precision (Andrews & Mallows 1974), it is a one-dimensional integral for any
/// number of rows.
struct TailTerm {
  double value;
  Eigen::VectorXd by_residual;    ///< derivative by r
  Eigen::MatrixXd by_covariance;  ///< derivative by V, symmetric
};

/// Computes the correction. `loss` must be a student_t, V symmetric and positive semidefinite with κ V ≤ I.
TailTerm tail_term(const Loss& loss, const Eigen::VectorXd& r, const Eigen::MatrixXd& V);

}  // namespace tandem::detail
