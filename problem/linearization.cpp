#include <memory>
#include <numeric>

#include <tandem/problem/problem.hpp>
#include <tandem/problem/soft_pool.hpp>

namespace tandem {
namespace {

Problem::Linearization linearization_of(const detail::PoolBase& pool, int index) {
  Problem::Linearization result;
  result.variable_ids.assign(pool.variables(index), pool.variables(index) + pool.arity());
  result.dofs.assign(pool.dofs(), pool.dofs() + pool.arity());
  result.residual.resize(pool.dim());
  result.jacobian.resize(pool.dim(), std::accumulate(result.dofs.begin(), result.dofs.end(), 0));
  pool.linearize_block(index, nullptr, result.residual.data(), result.jacobian.data());
  return result;
}

}  // namespace

std::vector<int> Problem::variable_ids(const Block& block) const {
  const int index = index_of(block, "variable_ids");
  const detail::PoolBase& pool = pools_[std::size_t(block.pool)].base();
  return {pool.variables(index), pool.variables(index) + pool.arity()};
}

Problem::Linearization Problem::linearization(const Block& block) const {
  const int index = index_of(block, "linearization");
  return linearization_of(pools_[std::size_t(block.pool)].base(), index);
}

Problem::Linearization Problem::linearization(const detail::ResidualFunctions& functions, const void* residual,
                                              std::span<const int> variable_ids) const {
  std::vector<std::unique_ptr<detail::StateStoreBase>> copies;
  std::vector<detail::StateStoreBase*> stores;
  std::vector<int> slots;
  if (variable_ids.size() != std::size_t(functions.arity))
    throw BadInputError(std::string(functions.name) + ": the residual reads " + std::to_string(functions.arity) +
                        " variables, not " + std::to_string(variable_ids.size()));
  for (const int id : variable_ids) {
    const VariableInfo& variable = info(id);
    if (!variable.store) throw_no_variable(id);
    if (variable.dof != functions.dofs[stores.size()])
      throw BadInputError(std::string(functions.name) + ": the residual cannot read variable " + variable.name() +
                          " at position " + std::to_string(stores.size()) + ", because its group differs");
    copies.push_back(variable.store->new_empty());
    stores.push_back(copies.back().get());
    slots.push_back(stores.back()->add_copy(*variable.store, variable.slot, id));
  }
  detail::SoftPool pool(functions, stores);
  pool.add_residual(residual, slots.data());
  return linearization_of(pool, 0);
}

}  // namespace tandem
