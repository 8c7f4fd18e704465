#include <algorithm>
#include <cmath>
#include <utility>

#include <tandem/problem/elimination.hpp>
#include <tandem/problem/marginal_prior.hpp>
#include <tandem/problem/problem.hpp>

namespace tandem {

/// Returns the blocks to replace, per pool in ascending order. Throws BadInputError if one is a hard block.
std::vector<std::vector<int>> Problem::blocks_to_marginalize(const std::vector<char>& marked) const {
  std::vector<std::vector<int>> affected(pools_.size());
  for (std::size_t p = 0; p < pools_.size(); ++p) {
    const auto& pool = pools_[p].base();
    for (int i = 0; i < pool.size(); ++i) {
      if (static_cast<int>(p) != prior_pool_ && !pool.reads(i, marked)) continue;
      if (pools_[p].hard)
        throw BadInputError("marginalize: a hard block (" + describe(pool, i) +
                            ") reads one of the variables; remove it first, only soft blocks can be marginalized");
      affected[p].push_back(i);
    }
  }
  return affected;
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
      const int* ids = pool.variables(i);
      for (int s = 0; s < pool.arity(); ++s)
        if (!std::exchange(seen[std::size_t(ids[s])], 1)) order.push_back(ids[s]);
    }
  std::sort(order.begin() + std::ptrdiff_t(variable_ids.size()), order.end(),
            [&](int a, int b) { return variables_[std::size_t(a)].sequence < variables_[std::size_t(b)].sequence; });
  std::vector<int> offset(variables_.size(), -1);
  std::vector<detail::MarginalPrior::State> states;
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
    if (affected[p].empty()) continue;
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
  detail::EliminatedQuadratic reduced = detail::eliminate(H, g, cost, eliminated);

  for (std::size_t p = 0; p < pools_.size(); ++p)
    for (auto i = affected[p].rbegin(); i != affected[p].rend(); ++i) remove_block_at(static_cast<int>(p), *i);
  for (const int id : variable_ids) remove_variable(id);
  if (prior_pool_ < 0) {
    prior_pool_ = static_cast<int>(pools_.size());
    pools_.push_back({std::make_unique<detail::MarginalPrior>(), nullptr, {}, {}, {}, {}, nullptr});
    pools_.back().soft->loss_scale = loss_scale_;
  }
  static_cast<detail::MarginalPrior&>(*pools_[std::size_t(prior_pool_)].soft)
      .set(std::move(states), std::move(reduced.A), std::move(reduced.b), reduced.constant);
  new_block(prior_pool_);
}

std::optional<Block> Problem::marginal_prior() const {
  if (prior_pool_ < 0) return {};
  const Pool& pool = pools_[std::size_t(prior_pool_)];
  if (pool.id_of_index.empty()) return {};
  return handle(prior_pool_, pool.id_of_index.front());
}

}  // namespace tandem
