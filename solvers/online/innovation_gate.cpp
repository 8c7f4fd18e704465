#include <cmath>

#include <tandem/solvers/online/innovation_gate.hpp>

namespace tandem::detail {

bool has_finite_cost(const Problem& problem, const Block& block) {
  const Eigen::VectorXd whitened = problem.noise(block).sqrt_information() * problem.linearization(block).residual;
  return std::isfinite(whitened.squaredNorm());
}

std::optional<double> innovation_sigmas(const FixedLag& lag, const Block& block, Eigen::Index rows) {
  const Problem& problem = lag.problem();
  if (!has_finite_cost(problem, block)) return HUGE_VAL;
  const Problem::Linearization at = problem.linearization(block);
  Eigen::MatrixXd P;
  try {
    P = lag.covariance(at.variable_ids, at.dofs);
  } catch (const Error&) {  // the last update had none to give
    return {};
  }
  const Eigen::MatrixXd W = problem.noise(block).sqrt_information();
  const Eigen::MatrixXd R = (W.transpose() * W).inverse();
  const Eigen::MatrixXd S = at.jacobian * P * at.jacobian.transpose() + R;
  const auto variances = S.diagonal().head(rows);
  if (!variances.allFinite() || !(variances.minCoeff() > 0)) return {};
  return (at.residual.head(rows).array().abs() / variances.array().sqrt()).maxCoeff();
}

}  // namespace tandem::detail
