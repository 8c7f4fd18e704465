#include <cmath>

#include <Eigen/Cholesky>

#include <tandem/solvers/online/innovation_gate.hpp>

namespace tandem::detail {
namespace {

bool has_finite_cost(const Gaussian& noise, const Eigen::VectorXd& residual) {
  return std::isfinite((noise.sqrt_information() * residual).squaredNorm());
}

}  // namespace

bool has_finite_cost(const Problem& problem, const Block& block) {
  return has_finite_cost(problem.noise(block), problem.linearization(block).residual);
}

std::optional<Innovation> normalized_innovation(const FixedLag& lag, const Block& block, Eigen::Index rows) {
  const Problem& problem = lag.problem();
  const Gaussian noise = problem.noise(block);
  const Problem::Linearization at = problem.linearization(block);
  if (!has_finite_cost(noise, at.residual)) return Innovation{HUGE_VAL, HUGE_VAL, rows};
  Eigen::MatrixXd P;
  try {
    P = lag.linearized_covariance(at.variable_ids, at.dofs);
  } catch (const NumericalError&) {  // the last update has no covariance
    return {};
  }
  const Eigen::MatrixXd JP = at.jacobian * P;
  const Eigen::MatrixXd S = noise.covariance_matrix() + JP * at.jacobian.transpose();
  const auto variances = S.diagonal().head(rows);
  if (!variances.allFinite() || !(variances.minCoeff() > 0)) return {};
  const Eigen::VectorXd e = at.residual.head(rows).cwiseQuotient(variances.cwiseSqrt());
  const Eigen::VectorXd scale = variances.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd correlation = scale.asDiagonal() * S.topLeftCorner(rows, rows) * scale.asDiagonal();
  return Innovation{e.cwiseAbs().maxCoeff(), e.dot(correlation.ldlt().solve(e)), rows, e};
}

}  // namespace tandem::detail
