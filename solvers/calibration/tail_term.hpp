#pragma once

#include <Eigen/Core>

#include <tandem/residuals/loss.hpp>

namespace tandem::detail {

/// What Laplace's approximation of the evidence leaves out of one block under Student's t, whose tails are no parabola's:
///
///   log E[t(e) / s(e)],   e ~ N(r, V),
///
/// r the whitened residual at the solution and V its covariance there, t = exp(−½ρ) and s the Gaussian that stands for it in the
/// Hessian, of information κ I, κ = ρ′(r²) expected_curvature(), and t's value and slope at r. The first term of an
/// expansion about Laplace's (Opper, Paquet & Winther 2013). t is a mixture of normal densities over their precision
/// (Andrews & Mallows 1974), so that this is one integral over that, whatever the rows.
struct TailTerm {
  double value;
  Eigen::VectorXd by_residual;    ///< at V
  Eigen::MatrixXd by_covariance;  ///< symmetric, at r
};

/// `loss`: of Student's t; V: symmetric, κ V at most I.
TailTerm tail_term(const Loss& loss, const Eigen::VectorXd& r, const Eigen::MatrixXd& V);

}  // namespace tandem::detail
