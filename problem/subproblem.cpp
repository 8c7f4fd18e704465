#include <algorithm>

#include <tandem/problem/subproblem.hpp>

namespace tandem {

Subproblem::Subproblem(Problem& whole, std::span<const int> variable_ids)
    : whole_(whole), serial_(whole.serial_), revision_(whole.revision_) {
  enum : char { outside, read, chosen };
  std::vector<char> role(whole.variables_.size(), outside);
  for (const int id : variable_ids) {
    if (!whole.info(id).store) whole.throw_no_variable(id);
    role[std::size_t(id)] = chosen;
  }

  blocks_.resize(whole.pools_.size());
  for (std::size_t p = 0; p < whole.pools_.size(); ++p) {
    const detail::PoolBase& pool = whole.pools_[p].base();
    for (int i = 0; i < pool.size(); ++i) {
      const std::span ids(pool.variables(i), std::size_t(pool.arity()));
      if (std::none_of(ids.begin(), ids.end(), [&](int id) { return role[std::size_t(id)] == chosen; })) continue;
      blocks_[p].in_whole.push_back(i);
      for (const int id : ids) role[std::size_t(id)] = std::max(role[std::size_t(id)], char(read));
    }
  }

  for (const auto& [type, store] : whole.stores_) part_.stores_[type] = store->new_empty();
  for (int id = 0; id < whole.id_bound(); ++id)
    if (role[std::size_t(id)] != outside) copied_.push_back({id, -1});
  std::sort(copied_.begin(), copied_.end(), [&](const Copied& a, const Copied& b) {
    return whole.variables_[std::size_t(a.whole_id)].sequence < whole.variables_[std::size_t(b.whole_id)].sequence;
  });
  const auto find_store = [&](const detail::StateStoreBase* store) {
    return std::find_if(whole.stores_.begin(), whole.stores_.end(),
                        [&](const auto& s) { return s.second.get() == store; });
  };
  std::vector<int> slot(whole.variables_.size(), -1);
  for (Copied& variable : copied_) {
    Problem::VariableInfo info = whole.variables_[std::size_t(variable.whole_id)];
    variable.id = part_.new_variable_id();
    detail::StateStoreBase& store = *part_.stores_[find_store(info.store)->first];
    slot[std::size_t(variable.whole_id)] = store.add_copy(*info.store, info.slot, variable.id);
    info.store = &store;
    info.slot = slot[std::size_t(variable.whole_id)];
    info.readers = 0;
    info.fixed = info.fixed || role[std::size_t(variable.whole_id)] != chosen;
    info.sequence = part_.next_sequence_++;
    part_.variables_[std::size_t(variable.id)] = std::move(info);
  }

  const detail::StoreMapping mapping = [&](const detail::StateStoreBase* store) {
    return part_.stores_[find_store(store)->first].get();
  };
  part_.pool_of_type_ = whole.pool_of_type_;
  part_.prior_pool_ = whole.prior_pool_;
  part_.constraint_pool_ = whole.constraint_pool_;
  for (std::size_t p = 0; p < whole.pools_.size(); ++p) {
    const Problem::Pool& from = whole.pools_[p];
    Problem::Pool& to = part_.pools_.emplace_back();
    to.type = from.type;
    if (from.soft) to.soft = from.soft->new_empty(mapping);
    if (from.hard) to.hard = from.hard->new_empty(mapping);
    for (const int i : blocks_[p].in_whole) {
      const int* const ids = from.base().variables(i);
      for (int s = 0; s < from.base().arity(); ++s) blocks_[p].slots.push_back(slot[std::size_t(ids[s])]);
    }
  }
  copy_blocks();
  for (std::size_t p = 0; p < blocks_.size(); ++p)
    for (std::size_t i = 0; i < blocks_[p].in_whole.size(); ++i) part_.new_block(static_cast<int>(p));
}

/// Copies all blocks. They keep their indices, so an NlpEvaluator of the part stays valid.
void Subproblem::copy_blocks() {
  for (std::size_t p = 0; p < blocks_.size(); ++p) {
    if (blocks_[p].in_whole.empty()) continue;
    const detail::PoolBase& from = whole_.pools_[p].base();
    detail::PoolBase& to = part_.pools_[p].base();
    while (to.size() > 0) to.remove(to.size() - 1);
    const int* slots = blocks_[p].slots.data();
    for (const int i : blocks_[p].in_whole) {
      to.add_copy(from, i, slots);
      slots += from.arity();
    }
  }
  ++part_.bounds_revision_;
  part_.scale_losses(whole_.loss_scale_);
}

void Subproblem::check_unchanged() const {
  if (whole_.serial_ != serial_ || whole_.revision_ != revision_)
    throw StaleHandleError(
        "the problem has changed since this Subproblem was made (variables or blocks were added, removed or fixed); "
        "make a new Subproblem");
}

void Subproblem::update_from_whole() {
  check_unchanged();
  copy_blocks();
  for (const Copied& variable : copied_) {
    const auto& from = whole_.variables_[std::size_t(variable.whole_id)];
    const auto& to = part_.variables_[std::size_t(variable.id)];
    to.store->copy_value(*from.store, from.slot, to.slot);
  }
  ++part_.value_revision_;
}

void Subproblem::write_back() {
  check_unchanged();
  for (const Copied& variable : copied_) {
    const auto& from = part_.variables_[std::size_t(variable.id)];
    const auto& to = whole_.variables_[std::size_t(variable.whole_id)];
    if (!from.fixed) to.store->copy_value(*from.store, from.slot, to.slot);
  }
  ++whole_.value_revision_;
}

}  // namespace tandem
