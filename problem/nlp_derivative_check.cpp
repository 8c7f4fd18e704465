#include <algorithm>
#include <numeric>

#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem {
namespace {

constexpr double kReach = 1e-6;     // Largest entry of the step to each side.
constexpr double kJump = 10;        // Change of a residual relative to the largest change that its Jacobians allow.
constexpr double kMismatch = 1e-2;  // Relative difference of the changes by finite differences and by the Jacobian.
constexpr double kRounding = 1e-8;  // Rounding error of the change, relative to the residual.

/// Rows of all blocks at a point, their change along a step that the Jacobian predicts, and the bound Σ |J| |step| on
/// it.
struct RowsNearby {
  Eigen::VectorXd value, change, bound;
};

}  // namespace

NlpEvaluator::DerivativeCheck NlpEvaluator::check_derivatives(const Eigen::VectorXd& direction) {
  const double largest = direction.cwiseAbs().maxCoeff();
  if (!(largest > 0)) return {};
  const Eigen::VectorXd step = (kReach / largest) * direction;

  const auto rows_at = [&](const Eigen::VectorXd& delta) {
    move_to(delta);  // Jacobians are with respect to perturbations of the point
    Eigen::Index size = 0;
    for (const auto& p : problem_.pools_) size += p.base().size() * p.base().dim();
    RowsNearby rows{Eigen::VectorXd(size), Eigen::VectorXd::Zero(size), Eigen::VectorXd::Zero(size)};
    Eigen::VectorXd jacobian;
    Eigen::Index row = 0;
    for (const auto& p : problem_.pools_) {
      const detail::PoolBase& pool = p.base();
      jacobian.resize(pool.dim() * std::accumulate(pool.dofs(), pool.dofs() + pool.arity(), 0));
      for (int i = 0; i < pool.size(); ++i, row += pool.dim()) {
        pool.linearize_block(i, nullptr, rows.value.data() + row, jacobian.data());
        const double* entry = jacobian.data();
        for (int s = 0; s < pool.arity(); entry += pool.dim() * pool.dofs()[s], ++s) {
          const int offset = offset_[std::size_t(pool.variables(i)[s])];
          if (offset < 0) continue;
          const Eigen::Map<const Eigen::MatrixXd> J(entry, pool.dim(), pool.dofs()[s]);
          const auto part = step.segment(offset, pool.dofs()[s]);
          rows.change.segment(row, pool.dim()) += J * part;
          rows.bound.segment(row, pool.dim()) += J.cwiseAbs() * part.cwiseAbs();
        }
      }
    }
    return rows;
  };
  RowsNearby here, ahead, behind;
  try {
    here = rows_at(Eigen::VectorXd::Zero(step.size()));
    ahead = rows_at(step);
    behind = rows_at(-step);
  } catch (const UndefinedResidualError&) {  // a residual is undefined nearby
    reset();
    return {};
  }
  reset();
  const Eigen::VectorXd after = ahead.value - here.value, before = here.value - behind.value;

  DerivativeCheck found;
  Eigen::Index row = 0;
  for (const auto& p : problem_.pools_) {
    const int dim = p.base().dim();
    for (int i = 0; i < p.base().size(); ++i, row += dim) {
      const auto part = [&](const Eigen::VectorXd& v) { return v.segment(row, dim); };
      const double rounding = kRounding * part(here.value).norm();
      const double bound = std::max({part(here.bound).norm(), part(ahead.bound).norm(), part(behind.bound).norm()});
      const double apart = (part(after) - part(before)).norm();
      if (apart > kJump * bound + rounding) return {DerivativeCheck::Kind::jump, problem_.describe(p.base(), i)};
      const double mismatch = (0.5 * (part(after) + part(before)) - part(here.change)).norm();
      if (found.kind == DerivativeCheck::Kind::none && mismatch > kMismatch * bound + apart + rounding)
        found = {DerivativeCheck::Kind::jacobian, problem_.describe(p.base(), i)};
    }
  }
  return found;
}

}  // namespace tandem
