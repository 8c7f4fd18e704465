#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

#include <tandem/problem/marginal_constraint.hpp>
#include <tandem/problem/marginal_prior.hpp>
#include <tandem/problem/problem_data.hpp>

namespace tandem::detail {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

std::vector<double> by_rows(const Eigen::MatrixXd& M) {
  const RowMajor rows = M;
  return {rows.data(), rows.data() + rows.size()};
}

std::vector<double> part_of(const std::vector<double>& all, int i, int n) {
  return {all.begin() + std::ptrdiff_t(i) * n, all.begin() + std::ptrdiff_t(i + 1) * n};
}

const std::type_info& type_of(const ResidualType& residual) { return residual.type(); }
const std::type_info& type_of(const GroupType& group) { return group.type; }

/// Returns the types by key(type); null if different types have the same key.
template <class Type, class Key>
auto by_key(std::span<const Type* const> types, Key key) {
  std::map<decltype(key(*types[0])), const Type*> result;
  for (const Type* type : types) {
    const auto [at, is_new] = result.try_emplace(key(*type), type);
    if (!is_new && at->second && type_of(*at->second) != type_of(*type)) at->second = nullptr;
  }
  return result;
}

/// Returns the residual types by name and role (true: constraint).
auto residual_types_by_name() {
  return by_key(residual_types(),
                [](const ResidualType& type) { return std::pair(type_name(type.type()), type.hard); });
}

auto group_types_by_name() {
  return by_key(group_types(), [](const GroupType& type) { return type_name(type.type); });
}

/// Returns the store of each state that the blocks of a pool read.
std::vector<const StateStoreBase*> stores_of(const SoftPoolBase* soft, const HardPoolBase* hard) {
  std::vector<const StateStoreBase*> stores;
  const StoreMapping record_store = [&](const StateStoreBase* store) {
    stores.push_back(store);
    return const_cast<StateStoreBase*>(store);  // the new pool is discarded
  };
  if (soft) soft->new_empty(record_store);
  if (hard) hard->new_empty(record_store);
  return stores;
}

std::string count(std::size_t n, const std::string& of) { return std::to_string(n) + " " + of + (n == 1 ? "" : "s"); }

const char* const kNotCompiled = " is not compiled into this program; read the file with a program that uses it";

/// Returns the pairs of slots of variables that correspond; see ProblemData::set_values(). `to_slots`: the slots of `to`
/// in the order of creation. The slots of `from` are in this order.
std::vector<std::pair<int, int>> corresponding(const StateStoreBase& from, const StateStoreBase& to,
                                               const std::vector<int>& to_slots) {
  std::vector<std::pair<int, int>> pairs;
  const auto same_name = [&](const auto& name, int slot) { return *name == *to.name[std::size_t(slot)]; };
  if (std::equal(from.name.begin(), from.name.end(), to_slots.begin(), to_slots.end(), same_name)) {
    for (std::size_t i = 0; i < to_slots.size(); ++i) pairs.emplace_back(static_cast<int>(i), to_slots[i]);
    return pairs;
  }
  std::map<std::string_view, std::pair<std::vector<int>, std::vector<int>>> by_name;  // slots of both
  for (std::size_t i = 0; i < from.name.size(); ++i) by_name[*from.name[i]].first.push_back(static_cast<int>(i));
  for (const int slot : to_slots) by_name[*to.name[std::size_t(slot)]].second.push_back(slot);
  for (const auto& [name, slots] : by_name)
    for (std::size_t i = 0; slots.first.size() == slots.second.size() && i < slots.first.size(); ++i)
      pairs.emplace_back(slots.first[i], slots.second[i]);
  return pairs;
}

}  // namespace

ProblemData::ProblemData(const Problem& problem) : loss_scale(problem.loss_scale_) {
  const auto types = residual_types_by_name();
  std::vector<int> place(problem.variables_.size(), -1), ids;
  for (std::size_t id = 0; id < place.size(); ++id)
    if (problem.variables_[id].store) ids.push_back(static_cast<int>(id));
  std::sort(ids.begin(), ids.end(),
            [&](int a, int b) { return problem.sequence_number(a) < problem.sequence_number(b); });
  std::map<const StateStoreBase*, std::string> groups;
  for (const auto& [type, store] : problem.stores_)
    for (const GroupType* group : group_types())
      if (type == group->type) groups[store.get()] = type_name(group->type);
  for (const int id : ids) {
    const auto& from = problem.variables_[std::size_t(id)];
    Fields fields;
    from.store->pass_value(from.slot, fields);
    if (!fields.complete())
      throw BadInputError("variable " + from.name() + " (" + groups[from.store] +
                          ") cannot be stored: " + fields.error());
    place[std::size_t(id)] = static_cast<int>(variables.size());
    variables.push_back({groups[from.store], from.name(), fields.values(), from.fixed});
  }

  for (const auto& pool : problem.pools_) {
    const PoolBase& base = pool.base();
    const int rows = base.dim();
    for (int i = 0; i < base.size(); ++i) {
      Block& block = blocks.emplace_back();
      for (int s = 0; s < base.arity(); ++s) block.variables.push_back(place[std::size_t(base.variables(i)[s])]);
      if (!pool.type) {
        const auto* prior = dynamic_cast<const MarginalPrior*>(&base);
        const AnchoredLinear& linear = prior ? prior->linear() : static_cast<const MarginalConstraint&>(base).linear();
        block.role = prior ? Role::marginal_prior : Role::marginal_constraint;
        block.A = by_rows(linear.A());
        block.b.assign(linear.b().data(), linear.b().data() + linear.rows());
        if (prior) block.constant = prior->constant();
        Fields anchors;
        for (const AnchoredState& s : linear.states()) s.store->pass_anchor(s.slot, anchors);
        block.anchors = anchors.values();
        continue;
      }
      block.residual = type_name(pool.type->type());
      const auto fail = [&](const std::string& why) {
        throw BadInputError("block " + problem.describe(base, i) + " (" + block.residual +
                            ") cannot be stored: " + why);
      };
      const auto type = types.find({block.residual, pool.type->hard});
      if (pool.type->made_at_run_time || type == types.end()) fail("the residual is defined at run time");
      if (!type->second) fail("several residual types of this program have this name");
      Fields fields;
      pool.type->pass(base.residual(i), fields, nullptr);
      if (!fields.complete()) fail(fields.error());
      block.data = fields.values();
      if (pool.hard) {
        block.role = Role::constraint;
        block.lower = part_of(pool.hard->lower(), i, rows);
        block.upper = part_of(pool.hard->upper(), i, rows);
        block.multipliers = part_of(pool.hard->multipliers(), i, rows);
      } else {
        const auto weight = static_cast<const WeightedPool&>(base).raw_weight(i);
        if (weight.full) {
          block.full = by_rows(Eigen::Map<const Eigen::MatrixXd>(weight.full, rows, rows));
        } else {
          block.diagonal.assign(weight.diagonal, weight.diagonal + rows);
        }
        block.loss = weight.loss;
      }
    }
  }
}

struct ProblemData::Builder {
  const ProblemData& data;
  Problem problem{};
  std::map<std::pair<std::string, bool>, const ResidualType*> types = residual_types_by_name();
  std::map<std::string, const GroupType*> groups = group_types_by_name();
  std::map<const PoolBase*, std::vector<const StateStoreBase*>> stores_of_pool{};

  void add_variable(const Variable& variable);
  void add_block(const Block& block);
  void add_cost(const Block& block, WeightedPool& pool);
  void add_constraint(const Block& block, HardPoolBase& pool);
  void add_marginal(const Block& block);
  std::vector<int> slots_of(const Block& block) const;
};

void ProblemData::Builder::add_variable(const Variable& variable) {
  const auto group = groups.find(variable.group);
  if (group == groups.end()) throw BadInputError("the group " + variable.group + kNotCompiled);
  if (!group->second) throw BadInputError("several groups of this program are named " + variable.group);
  if (variable.name.empty()) throw BadInputError("the name must not be empty");
  StateStoreBase* store = group->second->store_of(problem);
  const int id = problem.new_variable_id(), slot = store->add_identity(id, problem.variable_name(variable.name));
  Fields fields(variable.value);
  store->pass_value(slot, fields);
  if (!fields.error().empty()) throw BadInputError(fields.error());
  if (!fields.complete())
    throw BadInputError("a " + variable.group + " has " + count(fields.count(), "number") + ", not " +
                        std::to_string(variable.value.size()));
  problem.new_variable(id, *store, slot);
  problem.variables_[std::size_t(id)].fixed = variable.fixed;
}

std::vector<int> ProblemData::Builder::slots_of(const Block& block) const {
  std::vector<int> slots;
  for (const int v : block.variables) {
    if (v < 0 || v >= problem.id_bound())
      throw BadInputError("variable " + std::to_string(v) + " does not exist; variables are numbered from 0 to " +
                          std::to_string(problem.id_bound() - 1));
    slots.push_back(problem.variables_[std::size_t(v)].slot);
  }
  return slots;
}

void ProblemData::Builder::add_block(const Block& block) {
  if (is_marginal(block.role)) return add_marginal(block);
  const bool hard = block.role == Role::constraint;
  const auto type = types.find({block.residual, hard});
  if (type == types.end())
    throw BadInputError(std::string("the residual ") + block.residual + " as a " + (hard ? "constraint" : "cost") +
                        kNotCompiled);
  if (!type->second) throw BadInputError("several residuals of this program are named " + block.residual);
  const std::vector<int> slots = slots_of(block);
  const int index = problem.pool_of(*type->second);
  PoolBase& pool = problem.pools_[std::size_t(index)].base();
  if (int(slots.size()) != pool.arity())
    throw BadInputError("the residual reads " + count(std::size_t(pool.arity()), "variable") + ", not " +
                        std::to_string(slots.size()));
  std::vector<const StateStoreBase*>& stores = stores_of_pool[&pool];
  if (stores.empty())
    stores = stores_of(problem.pools_[std::size_t(index)].soft.get(), problem.pools_[std::size_t(index)].hard.get());
  for (std::size_t s = 0; s < slots.size(); ++s) {
    const auto& variable = problem.variables_[std::size_t(block.variables[s])];
    if (variable.store != stores[s])
      throw BadInputError("the residual cannot read variable " + variable.name() + " at position " + std::to_string(s) +
                          ", because it is a " + data.variables[std::size_t(block.variables[s])].group);
  }
  Fields fields(block.data);
  const auto add_residual = [&](const void* residual) { pool.add_residual(residual, slots.data()); };
  const ResidualType::Use add = add_residual;
  type->second->pass(nullptr, fields, &add);
  if (!fields.error().empty()) throw BadInputError(fields.error());
  if (!fields.complete())
    throw BadInputError("data must be " + count(fields.count(), "number") + ", not " +
                        std::to_string(block.data.size()));
  if (hard) {
    add_constraint(block, static_cast<HardPoolBase&>(pool));
  } else {
    add_cost(block, static_cast<WeightedPool&>(pool));
  }
  problem.new_block(index);
}

void ProblemData::Builder::add_cost(const Block& block, WeightedPool& pool) {
  const std::size_t n = std::size_t(pool.dim());
  const bool full = !block.full.empty();
  if (full ? block.full.size() != n * n : block.diagonal.size() != n)
    throw BadInputError("the noise has " + count(full ? block.full.size() : block.diagonal.size(), "number") +
                        ", but " + count(n, "row") + (n == 1 ? " needs " : " need ") +
                        std::to_string(full ? n * n : n));
  Eigen::MatrixXd W;
  if (full) {
    W = Eigen::Map<const RowMajor>(block.full.data(), pool.dim(), pool.dim());
    Gaussian::square_root(W);  // throws if W is singular
  } else if (std::any_of(block.diagonal.begin(), block.diagonal.end(), [](double w) { return !(w > 0); })) {
    throw BadInputError("the noise must be positive");
  }
  if (!(block.loss.scale > 0)) throw BadInputError("the scale of the loss must be positive");
  const std::vector<double> none(n, 0.0);
  pool.add_raw_weight({full ? none.data() : block.diagonal.data(), full ? W.data() : nullptr, block.loss});
}

void ProblemData::Builder::add_constraint(const Block& block, HardPoolBase& pool) {
  const std::size_t n = std::size_t(pool.dim());
  for (const auto& [name, rows] : {std::pair("lower bounds", &block.lower), std::pair("upper bounds", &block.upper),
                                   std::pair("multipliers", &block.multipliers)})
    if (rows->size() != n)
      throw BadInputError(std::string(name) + " must be " + count(n, "number") + ", not " +
                          std::to_string(rows->size()));
  Problem::check_bounds(pool.name(), pool.dim(), block.lower.data(), block.upper.data());
  pool.add_bounds(block.lower.data(), block.upper.data());
  pool.set_multipliers(pool.size() - 1, block.multipliers.data());
}

void ProblemData::Builder::add_marginal(const Block& block) {
  const bool hard = block.role == Role::marginal_constraint;
  const std::string what = hard ? "marginal constraint" : "marginal prior";
  int& index = hard ? problem.constraint_pool_ : problem.prior_pool_;
  if (index >= 0) throw BadInputError("a problem has at most one " + what);
  slots_of(block);  // throws if a variable does not exist
  std::vector<AnchoredState> states;
  std::size_t columns = 0;
  std::vector<char> seen(std::size_t(problem.id_bound()), 0);
  for (const int id : block.variables) {
    const auto& variable = problem.variables_[std::size_t(id)];
    if (std::exchange(seen[std::size_t(id)], 1))
      throw BadInputError("the " + what + " reads " + variable.name() + " twice");
    states.push_back({variable.store, variable.slot, id, variable.dof});
    columns += std::size_t(variable.dof);
  }
  const std::size_t rows = block.b.size();
  if (block.A.size() != rows * columns)
    throw BadInputError("A has " + count(block.A.size(), "number") + ", but must have " + std::to_string(rows) +
                        " rows of " + std::to_string(columns));
  const Eigen::MatrixXd A = Eigen::Map<const RowMajor>(block.A.data(), Eigen::Index(rows), Eigen::Index(columns));
  const Eigen::VectorXd b = Eigen::Map<const Eigen::VectorXd>(block.b.data(), Eigen::Index(rows));
  Problem::Pool pool;
  if (hard) {
    auto constraint = std::make_unique<MarginalConstraint>();
    constraint->set(states, A, b);
    pool.hard = std::move(constraint);
  } else {
    auto prior = std::make_unique<MarginalPrior>();
    prior->set(states, A, b, block.constant);
    pool.soft = std::move(prior);
  }
  Fields anchors(block.anchors);
  for (const AnchoredState& s : states) s.store->pass_anchor(s.slot, anchors);
  if (!anchors.error().empty()) throw BadInputError(anchors.error());
  if (!anchors.complete())
    throw BadInputError("anchors must be " + count(anchors.count(), "number") + ", not " +
                        std::to_string(block.anchors.size()));
  index = static_cast<int>(problem.pools_.size());
  problem.pools_.push_back(std::move(pool));
  problem.new_block(index);
}

Problem ProblemData::problem() const {
  Builder builder{*this};
  for (std::size_t i = 0; i < variables.size(); ++i) try {
      builder.add_variable(variables[i]);
    } catch (const BadInputError& error) {
      throw BadInputError("variable " + std::to_string(i) + " (" + variables[i].name + "): " + error.what());
    }
  for (std::size_t i = 0; i < blocks.size(); ++i) try {
      builder.add_block(blocks[i]);
    } catch (const BadInputError& error) {
      throw BadInputError("block " + std::to_string(i) + ": " + error.what());
    }
  builder.problem.scale_losses(loss_scale);
  return std::move(builder.problem);
}

ProblemData::Values ProblemData::values(const Problem& problem) {
  Values values;
  for (const auto& [type, store] : problem.stores_) {
    std::unique_ptr<StateStoreBase> copy = store->new_empty();
    for (const int id : problem.ids_by_creation(*store))
      copy->add_copy(*store, problem.variables_[std::size_t(id)].slot, id);
    values.emplace(type, std::move(copy));
  }
  return values;
}

template <class F>
void ProblemData::for_corresponding(Problem& problem, const Values& values, F f) {
  for (const auto& [type, store] : problem.stores_) {
    const auto from = values.find(type);
    if (from == values.end()) continue;
    std::vector<int> slots;
    for (const int id : problem.ids_by_creation(*store)) slots.push_back(problem.variables_[std::size_t(id)].slot);
    for (const auto& [ours, theirs] : corresponding(*from->second, *store, slots)) f(type, *store, ours, theirs);
  }
  ++problem.value_revision_;
}

void ProblemData::set_values(Problem& problem, const Values& values) {
  for_corresponding(problem, values, [&](std::type_index group, StateStoreBase& store, int from_slot, int slot) {
    store.copy_value(*values.at(group), from_slot, slot);
  });
}

void ProblemData::move_values(Problem& problem, const Values& before, const Values& after) {
  for_corresponding(problem, before, [&](std::type_index group, StateStoreBase& store, int from_slot, int slot) {
    store.move_value(*before.at(group), *after.at(group), from_slot, slot);
  });
}

}  // namespace tandem::detail
