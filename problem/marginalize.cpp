#include <algorithm>
#include <cmath>
#include <utility>

#include <tandem/problem/elimination.hpp>
#include <tandem/problem/marginal_prior.hpp>
#include <tandem/problem/problem.hpp>

namespace tandem {

/// Of each pool, in ascending order. Throws Error where a hard block reads one.
std::vector<std::vector<int>> Problem::blocks_to_marginalize(const std::vector<char>& marked) const {
  std::vector<std::vector<int>> touched(pools_.size());
  for (std::size_t p = 0; p < pools_.size(); ++p) {
    const auto& pool = pools_[p].base();
    for (int i = 0; i < pool.size(); ++i) {
      if (static_cast<int>(p) != prior_pool_ && !pool.reads(i, marked)) continue;
      if (pools_[p].hard)
        throw Error("marginalize: a hard block reads a variable to go, the " + describe(pool, i) +
                    "; only soft ones can be marginalized");
      touched[p].push_back(i);
    }
  }
  return touched;
}

void Problem::marginalize(std::span<const int> variable_ids) {
  if (variable_ids.empty()) return;
  std::vector<char> marked(variables_.size(), 0);
  for (const int id : variable_ids) {
    if (std::size_t(id) >= variables_.size() || !variables_[std::size_t(id)].store || marked[std::size_t(id)])
      throw Error("marginalize: there is no variable " + std::to_string(id) + " (any more), or it is given twice");
    marked[std::size_t(id)] = 1;
  }
  const std::vector<std::vector<int>> touched = blocks_to_marginalize(marked);

  // Unknowns of the small dense system: those to go, then the others that the blocks read, by creation.
  std::vector<int> order(variable_ids.begin(), variable_ids.end());
  std::vector<char> seen = marked;
  for (std::size_t p = 0; p < pools_.size(); ++p)
    for (const int i : touched[p]) {
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

  // The touched blocks alone, straight into it: only their entries of a placement are read.
  for (auto& [type, store] : stores_) store->reset();
  point_of_ = nullptr;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
  double cost = 0;
  detail::PoolPlacement place;
  for (std::size_t p = 0; p < pools_.size(); ++p) {
    if (touched[p].empty()) continue;
    const auto& pool = *pools_[p].soft;
    const std::size_t arity = std::size_t(pool.arity()), pairs = arity * (arity + 1) / 2;
    place.offset.resize(std::max(place.offset.size(), std::size_t(touched[p].back() + 1) * arity));
    place.hessian.resize(std::max(place.hessian.size(), std::size_t(touched[p].back() + 1) * pairs));
    for (const int i : touched[p]) {
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
        throw Error("marginalize: not finite at the variables' values: " + describe(pool, i));
    }
  }
  for (int j = 0; j < n; ++j)  // blocks below the diagonal were filled, those on it in full
    for (int i = j + 1; i < n; ++i) H(j, i) = H(i, j);
  if (!H.allFinite()) throw Error("marginalize: a Jacobian is not finite at the variables' values");
  detail::EliminatedQuadratic left = detail::eliminate(H, g, cost, eliminated);

  for (std::size_t p = 0; p < pools_.size(); ++p)
    for (auto i = touched[p].rbegin(); i != touched[p].rend(); ++i) remove_block_at(static_cast<int>(p), *i);
  for (const int id : variable_ids) remove_variable(id);
  if (prior_pool_ < 0) {
    prior_pool_ = static_cast<int>(pools_.size());
    pools_.push_back({std::make_unique<detail::MarginalPrior>(), nullptr, {}, {}, {}, nullptr});
    pools_.back().soft->widening = widening_;
  }
  static_cast<detail::MarginalPrior&>(*pools_[std::size_t(prior_pool_)].soft)
      .set(std::move(states), std::move(left.A), std::move(left.b), left.constant);
  new_block(prior_pool_);
}

std::optional<Block> Problem::marginal_prior() const {
  if (prior_pool_ < 0) return {};
  const Pool& pool = pools_[std::size_t(prior_pool_)];
  if (pool.id_of_index.empty()) return {};
  const int id = pool.id_of_index.front();
  return Block{prior_pool_, id, pool.ids.generation(id)};
}

}  // namespace tandem
