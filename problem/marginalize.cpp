#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <tandem/problem/elimination.hpp>
#include <tandem/problem/marginal_constraint.hpp>
#include <tandem/problem/marginal_prior.hpp>
#include <tandem/problem/problem.hpp>

namespace tandem {
namespace {

/// Returns the bound at which each row of a hard block is active, NaN if it is inactive. Active rows are equalities,
/// and inequalities whose multiplier is not zero.
std::vector<double> active_bounds(const detail::HardPoolBase& pool, int block) {
  std::vector<double> bounds(std::size_t(pool.dim()), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t row = 0, at = std::size_t(block * pool.dim()); row < bounds.size(); ++row, ++at) {
    const double lower = pool.lower()[at], upper = pool.upper()[at], y = pool.multipliers()[at];
    if (lower == upper || y > 0) bounds[row] = upper;
    if (y < 0) bounds[row] = lower;
  }
  std::replace_if(
      bounds.begin(), bounds.end(), [](double x) { return std::isinf(x); }, NAN);
  return bounds;
}

bool has_active_row(const detail::HardPoolBase& pool, int block) {
  const std::vector<double> bounds = active_bounds(pool, block);
  return !std::all_of(bounds.begin(), bounds.end(), [](double x) { return std::isnan(x); });
}

}  // namespace

/// Returns the blocks to replace, per pool in ascending order.
std::vector<std::vector<int>> Problem::blocks_to_marginalize(const std::vector<char>& marked) const {
  std::vector<std::vector<int>> affected(pools_.size());
  for (std::size_t p = 0; p < pools_.size(); ++p) {
    const auto& pool = pools_[p].base();
    const bool always = static_cast<int>(p) == prior_pool_ || static_cast<int>(p) == constraint_pool_;
    for (int i = 0; i < pool.size(); ++i)
      if (always || pool.reads(i, marked)) affected[p].push_back(i);
  }
  return affected;
}

/// Returns the linear equations of the active rows of hard blocks. `offset` is the first unknown of each variable, −1
/// if it is fixed.
detail::LinearRows Problem::active_rows(const std::vector<std::vector<int>>& affected, const std::vector<int>& offset,
                                        int unknowns) const {
  detail::LinearRows equations{Eigen::MatrixXd(0, unknowns), {}};
  Eigen::VectorXd r, J;
  std::vector<int> own;
  for (std::size_t p = 0; p < pools_.size(); ++p) {
    if (!pools_[p].hard) continue;
    const detail::HardPoolBase& pool = *pools_[p].hard;
    const std::vector<int> dofs(pool.dofs(), pool.dofs() + pool.arity());
    r.resize(pool.dim());
    J.resize(pool.dim() * std::accumulate(dofs.begin(), dofs.end(), 0));
    for (const int i : affected[p]) {
      if (!has_active_row(pool, i)) continue;
      const std::vector<double> bounds = active_bounds(pool, i);
      own.clear();
      for (int s = 0; s < pool.arity(); ++s) own.push_back(offset[std::size_t(pool.variables(i)[s])]);
      pool.linearize_block(i, own.data(), r.data(), J.data());
      if (!r.allFinite() || !J.allFinite())
        throw UndefinedResidualError("marginalize: " + describe(pool, i) + " is not finite at the current values");
      for (int row = 0; row < pool.dim(); ++row) {
        if (std::isnan(bounds[std::size_t(row)])) continue;
        const Eigen::Index to = equations.A.rows();
        equations.A.conservativeResize(to + 1, Eigen::NoChange);
        equations.A.row(to).setZero();
        equations.b.conservativeResize(to + 1);
        equations.b[to] = r[row] - bounds[std::size_t(row)];
        for (std::size_t s = 0, column = 0; s < dofs.size(); column += std::size_t(dofs[s++]))
          for (int k = 0; own[s] >= 0 && k < dofs[s]; ++k)  // a block may read a variable twice
            equations.A(to, own[s] + k) += J[(Eigen::Index(column) + k) * pool.dim() + row];
      }
    }
  }
  return equations;
}

/// Adds the constraint on the remaining variables. Variables without a coefficient are omitted.
void Problem::add_marginal_constraint(const std::vector<detail::AnchoredState>& states,
                                      const detail::LinearRows& equations) {
  if (equations.A.rows() == 0) return;
  std::vector<detail::AnchoredState> read;
  Eigen::MatrixXd A(equations.A.rows(), 0);
  Eigen::Index column = 0;
  for (const auto& state : states) {
    const auto block = equations.A.middleCols(column, state.dof);
    column += state.dof;
    if (block.isZero(0)) continue;
    read.push_back(state);
    A.conservativeResize(Eigen::NoChange, A.cols() + state.dof);
    A.rightCols(state.dof) = block;
  }
  if (constraint_pool_ < 0) {
    constraint_pool_ = static_cast<int>(pools_.size());
    pools_.push_back({nullptr, std::make_unique<detail::MarginalConstraint>(), {}, {}, {}, {}, nullptr});
  }
  static_cast<detail::MarginalConstraint&>(*pools_[std::size_t(constraint_pool_)].hard)
      .set(std::move(read), std::move(A), equations.b);
  new_block(constraint_pool_);
}

void Problem::marginalize(std::span<const int> variable_ids) {
  if (variable_ids.empty()) return;
  std::vector<char> marked(variables_.size(), 0);
  for (const int id : variable_ids) {
    if (!info(id).store) throw_no_variable(id);
    if (std::exchange(marked[std::size_t(id)], 1))
      throw BadInputError("marginalize: variable " + name(id) + " is given twice");
  }
  const std::vector<std::vector<int>> affected = blocks_to_marginalize(marked);

  // Unknowns of the dense system: the variables to marginalise, then the others that the blocks read, by creation.
  std::vector<int> order(variable_ids.begin(), variable_ids.end());
  std::vector<char> seen = marked;
  for (std::size_t p = 0; p < pools_.size(); ++p)
    for (const int i : affected[p]) {
      const auto& pool = pools_[p].base();
      if (pools_[p].hard && !has_active_row(*pools_[p].hard, i)) continue;
      const int* ids = pool.variables(i);
      for (int s = 0; s < pool.arity(); ++s)
        if (!std::exchange(seen[std::size_t(ids[s])], 1)) order.push_back(ids[s]);
    }
  std::sort(order.begin() + std::ptrdiff_t(variable_ids.size()), order.end(),
            [&](int a, int b) { return variables_[std::size_t(a)].sequence < variables_[std::size_t(b)].sequence; });
  std::vector<int> offset(variables_.size(), -1);
  std::vector<detail::AnchoredState> states;
  int n = 0, eliminated = 0;
  for (const int id : order) {
    const VariableInfo& v = variables_[std::size_t(id)];
    if (v.fixed) continue;
    offset[std::size_t(id)] = n;
    n += v.dof;
    if (marked[std::size_t(id)]) {
      eliminated = n;
    } else {
      states.push_back({v.store, v.slot, id, v.dof});
    }
  }

  // Only the affected blocks are accumulated, directly into the dense system. Only their placements are set.
  for (auto& [type, store] : stores_) store->reset();
  point_owner_ = nullptr;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
  double cost = 0;
  detail::PoolPlacement place;
  for (std::size_t p = 0; p < pools_.size(); ++p) {
    if (affected[p].empty() || !pools_[p].soft) continue;
    const auto& pool = *pools_[p].soft;
    const std::size_t arity = std::size_t(pool.arity()), pairs = arity * (arity + 1) / 2;
    place.offset.resize(std::max(place.offset.size(), std::size_t(affected[p].back() + 1) * arity));
    place.hessian.resize(std::max(place.hessian.size(), std::size_t(affected[p].back() + 1) * pairs));
    for (const int i : affected[p]) {
      const int* ids = pool.variables(i);
      for (std::size_t a = 0, pair = std::size_t(i) * pairs; a < arity; ++a) {
        const int row = offset[std::size_t(ids[a])];
        place.offset[std::size_t(i) * arity + a] = row;
        for (std::size_t b = 0; b <= a; ++b, ++pair) {
          const int column = offset[std::size_t(ids[b])];
          place.hessian[pair] = {std::min(row, column) * n + std::max(row, column), n, row < column};
        }
      }
      cost += pool.accumulate(place, i, i + 1, g.data(), H.data());
      if (!std::isfinite(cost) || !g.allFinite())
        throw UndefinedResidualError("marginalize: " + describe(pool, i) + " is not finite at the current values");
    }
  }
  for (int j = 0; j < n; ++j)  // off-diagonal blocks were added to the lower triangle only
    for (int i = j + 1; i < n; ++i) H(j, i) = H(i, j);
  if (!H.allFinite()) throw UndefinedResidualError("marginalize: a Jacobian is not finite at the current values");
  detail::EliminatedProgram reduced = detail::eliminate(H, g, cost, eliminated, active_rows(affected, offset, n));

  for (std::size_t p = 0; p < pools_.size(); ++p)
    for (auto i = affected[p].rbegin(); i != affected[p].rend(); ++i) remove_block_at(static_cast<int>(p), *i);
  for (const int id : variable_ids) remove_variable(id);
  if (prior_pool_ < 0) {
    prior_pool_ = static_cast<int>(pools_.size());
    pools_.push_back({std::make_unique<detail::MarginalPrior>(), nullptr, {}, {}, {}, {}, nullptr});
    pools_.back().soft->loss_scale = loss_scale_;
  }
  add_marginal_constraint(states, reduced.equations);
  static_cast<detail::MarginalPrior&>(*pools_[std::size_t(prior_pool_)].soft)
      .set(std::move(states), std::move(reduced.A), std::move(reduced.b), reduced.constant);
  new_block(prior_pool_);
}

std::optional<Block> Problem::marginal_prior() const { return only_block(prior_pool_); }
std::optional<Block> Problem::marginal_constraint() const { return only_block(constraint_pool_); }

std::optional<Block> Problem::only_block(int index) const {
  if (index < 0 || pools_[std::size_t(index)].id_of_index.empty()) return {};
  return handle(index, pools_[std::size_t(index)].id_of_index.front());
}

}  // namespace tandem
