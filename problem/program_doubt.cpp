#include <algorithm>
#include <numeric>

#include <tandem/problem/program.hpp>

namespace tandem {
namespace {

constexpr double kReach = 1e-6;     // of the largest entry of a step to either side
constexpr double kJump = 10;        // change of a residual over that reach, against what its Jacobians allow
constexpr double kMismatch = 1e-2;  // relative, of a change by differences and by the Jacobian
constexpr double kRounding = 1e-8;  // of a residual, in a difference over that reach

/// The rows of all blocks at a program's point, one after the other, how they change along a step by the Jacobian, and
/// the most that they could, whatever its direction.
struct RowsNearby {
  Eigen::VectorXd value, change, most;
};

}  // namespace

Program::Doubt Program::doubt(const Eigen::VectorXd& direction) {
  const double largest = direction.cwiseAbs().maxCoeff();
  if (!(largest > 0)) return {};
  const Eigen::VectorXd step = (kReach / largest) * direction;

  const auto rows_at = [&](const Eigen::VectorXd& delta) {
    move_to(delta);  // without charts: Jacobians are by perturbations of the point
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
          rows.most.segment(row, pool.dim()) += J.cwiseAbs() * part.cwiseAbs();
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
  } catch (const Error&) {  // undefined so near
    reset();
    return {};
  }
  reset();
  const Eigen::VectorXd after = ahead.value - here.value, before = here.value - behind.value;

  Doubt found;
  Eigen::Index row = 0;
  for (const auto& p : problem_.pools_) {
    const int dim = p.base().dim();
    for (int i = 0; i < p.base().size(); ++i, row += dim) {
      const auto part = [&](const Eigen::VectorXd& v) { return v.segment(row, dim); };
      const double rounding = kRounding * part(here.value).norm();
      const double most = std::max({part(here.most).norm(), part(ahead.most).norm(), part(behind.most).norm()});
      const double apart = (part(after) - part(before)).norm();
      if (apart > kJump * most + rounding) return {Doubt::Kind::jump, problem_.describe(p.base(), i)};
      const double mismatch = (0.5 * (part(after) + part(before)) - part(here.change)).norm();
      if (found.kind == Doubt::Kind::none && mismatch > kMismatch * most + apart + rounding)
        found = {Doubt::Kind::jacobian, problem_.describe(p.base(), i)};
    }
  }
  return found;
}

}  // namespace tandem
