#include <algorithm>

#include <tandem/problem/marginal_constraint.hpp>
#include <tandem/problem/marginal_prior.hpp>
#include <tandem/problem/problem.hpp>

namespace tandem {

Problem Problem::copy() const {
  Problem copy;
  std::map<const detail::StateStoreBase*, detail::StateStoreBase*> counterparts;
  for (const auto& [type, store] : stores_) counterparts[store.get()] = (copy.stores_[type] = store->copy()).get();

  copy.variables_ = variables_;
  for (VariableInfo& variable : copy.variables_)
    if (variable.store) variable.store = counterparts.at(variable.store);
  copy.ids_ = ids_;
  copy.next_sequence_ = next_sequence_;

  const detail::StoreMapping mapping = [&](const detail::StateStoreBase* store) { return counterparts.at(store); };
  for (std::size_t p = 0; p < pools_.size(); ++p) {
    const Pool& from = pools_[p];
    Pool& to = copy.pools_.emplace_back();
    to.ids = from.ids;
    to.index_of_id = from.index_of_id;
    to.id_of_index = from.id_of_index;
    to.problem_of_id = from.problem_of_id;
    to.type = from.type;
    if (static_cast<int>(p) == prior_pool_) {
      to.soft = static_cast<const detail::MarginalPrior&>(*from.soft).copy(mapping);
      continue;
    }
    if (static_cast<int>(p) == constraint_pool_) {
      to.hard = static_cast<const detail::MarginalConstraint&>(*from.hard).copy(mapping);
      continue;
    }
    if (from.soft) to.soft = from.soft->new_empty(mapping);
    if (from.hard) to.hard = from.hard->new_empty(mapping);
    std::vector<int> slots(std::size_t(from.base().arity()));
    for (int i = 0; i < from.base().size(); ++i) {
      const int* ids = from.base().variables(i);
      for (std::size_t s = 0; s < slots.size(); ++s) slots[s] = variables_[std::size_t(ids[s])].slot;
      to.base().add_copy(from.base(), i, slots.data());
    }
  }
  copy.pool_of_type_ = pool_of_type_;
  copy.prior_pool_ = prior_pool_;
  copy.constraint_pool_ = constraint_pool_;
  copy.loss_scale_ = loss_scale_;
  copy.revision_ = revision_;
  copy.value_revision_ = value_revision_;
  copy.bounds_revision_ = bounds_revision_;
  return copy;
}

void Problem::check_counterpart(const VariableHandle& x) const {
  if (!ids_.is_current(x.slot, x.generation) || handle(x.slot).name != x.name)  // one object, not equal text
    throw StaleHandleError("counterpart: the problem has no variable for this handle" +
                           (x.name ? " (" + *x.name + ")" : std::string()) +
                           "; the variable was removed, or neither problem is a copy of the other");
}

Block Problem::counterpart(const Block& block) const {
  const bool exists = std::size_t(block.pool) < pools_.size() &&
                      pools_[std::size_t(block.pool)].ids.is_current(block.id, block.generation) &&
                      pools_[std::size_t(block.pool)].base().name() == block.residual;
  if (!exists)
    throw StaleHandleError("counterpart: the problem has no block for this handle (" + std::string(block.residual) +
                           "); build both problems by the same calls");
  return handle(block.pool, block.id);
}

std::vector<int> Problem::ids_by_creation(const detail::StateStoreBase& store) const {
  std::vector<int> ids;
  for (int id = 0; id < id_bound(); ++id)
    if (variables_[std::size_t(id)].store == &store) ids.push_back(id);
  std::sort(ids.begin(), ids.end(), [&](int a, int b) { return sequence_number(a) < sequence_number(b); });
  return ids;
}

std::vector<Block> Problem::blocks() const {
  std::vector<Block> result;
  for (std::size_t p = 0; p < pools_.size(); ++p)
    for (const int id : pools_[p].id_of_index) result.push_back(handle(static_cast<int>(p), id));
  return result;
}

std::string Problem::describe(const Block& block) const {
  const int index = index_of(block, "describe");
  return describe(pools_[std::size_t(block.pool)].base(), index);
}

}  // namespace tandem
