#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numeric>

#include <tandem/problem/problem.hpp>
#include <tandem/problem/soft_pool.hpp>

namespace tandem {
namespace {

void check_noise(std::string_view name, int rows, const Gaussian& noise) {
  if (noise.dim() != rows)
    throw BadInputError(std::string(name) + ": the residual has " + std::to_string(rows) + " rows, but the noise has " +
                        std::to_string(noise.dim()));
}

void check_loss(std::string_view name, const Loss& loss) {
  if (!(loss.scale > 0)) throw BadInputError(std::string(name) + ": the scale of the loss must be positive");
}

}  // namespace

std::uint64_t detail::new_problem_serial() {
  static std::atomic<std::uint64_t> last = 0;
  return ++last;
}

void Problem::swap(Problem& other) noexcept {
  auto own = contents(), others = other.contents();
  own.swap(others);
  point_owner_ = other.point_owner_ = nullptr;  // evaluators refer to the object, not to its contents
}

int Problem::new_variable_id() {
  const int id = ids_.allocate();
  if (id == static_cast<int>(variables_.size())) variables_.emplace_back();
  return id;
}

detail::VariableName Problem::variable_name(std::string name) const {
  if (name.empty()) name = "variable " + std::to_string(next_sequence_);
  return std::make_shared<const std::string>(std::move(name));
}

VariableHandle Problem::new_variable(int id, detail::StateStoreBase& store, int slot) {
  variables_[std::size_t(id)] = {&store, slot, store.dof(), 0, false, next_sequence_++};
  ++revision_;
  return handle(id);
}

const std::string& Problem::VariableInfo::name() const {
  static const std::string none;
  return store ? *store->name[std::size_t(slot)] : none;
}

VariableHandle Problem::handle(int variable_id) const {
  const VariableInfo& variable = info(variable_id);
  if (!variable.store) return {};
  return {serial_, variable_id, ids_.generation(variable_id), variable.store->name[std::size_t(variable.slot)]};
}

Block Problem::handle(int pool, int id) const {
  const Pool& p = pools_[std::size_t(pool)];
  return {pool, id, p.ids.generation(id), p.problem_of_id[std::size_t(id)], p.base().name()};
}

void Problem::throw_invalid(const VariableHandle& x) const {
  if (x.problem == 0)
    throw StaleHandleError("the variable was never added to a problem; use a handle returned by Problem::add");
  throw StaleHandleError("variable " + *x.name +
                         (x.problem == serial_ ? " has been removed from the problem"
                                               : " belongs to another problem, or to earlier contents of this one; "
                                                 "use a handle from this problem (see Problem::counterpart)"));
}

void Problem::throw_no_variable(int variable_id) const {
  throw StaleHandleError("the problem has no variable with ID " + std::to_string(variable_id) + "; IDs are below " +
                         std::to_string(id_bound()));
}

void Problem::remove_variable(int id) {
  VariableInfo& variable = variables_[std::size_t(id)];
  if (variable.readers > 0) {
    std::string reader;
    for (const auto& p : pools_)
      for (int i = 0; reader.empty() && i < p.base().size(); ++i) {
        const int* ids = p.base().variables(i);
        if (std::find(ids, ids + p.base().arity(), id) != ids + p.base().arity()) reader = describe(p.base(), i);
      }
    throw BadInputError("remove: variable " + variable.name() + " is still read by a block (" + reader +
                        "); remove that block first, or marginalize the variable");
  }
  variable.store->remove(variable.slot);
  variable = {};
  ids_.release(id);
  ++revision_;
}

std::string Problem::describe(const detail::PoolBase& pool, int block) const {
  std::string text = std::string(pool.name()) + " of ";
  for (int s = 0; s < pool.arity(); ++s) text += (s ? ", " : "") + name(pool.variables(block)[s]);
  return text;
}

/// Returns a handle for the last block of a pool.
Block Problem::new_block(int index) {
  Pool& pool = pools_[std::size_t(index)];
  const int id = pool.ids.allocate();
  const int last = static_cast<int>(pool.id_of_index.size());
  if (id == static_cast<int>(pool.index_of_id.size())) {
    pool.index_of_id.push_back(-1);
    pool.problem_of_id.push_back(0);
  }
  pool.index_of_id[std::size_t(id)] = last;
  pool.problem_of_id[std::size_t(id)] = serial_;
  pool.id_of_index.push_back(id);
  const int* ids = pool.base().variables(last);
  for (int s = 0; s < pool.base().arity(); ++s) ++variables_[std::size_t(ids[s])].readers;
  ++revision_;
  return handle(index, id);
}

bool Problem::has(const Block& block) const {
  if (std::size_t(block.pool) >= pools_.size()) return false;
  const Pool& pool = pools_[std::size_t(block.pool)];
  return pool.ids.is_current(block.id, block.generation) && pool.problem_of_id[std::size_t(block.id)] == block.problem;
}

int Problem::index_of(const Block& block, const char* caller) const {
  if (!has(block))
    throw StaleHandleError(
        std::string(caller) + ": no such block in the problem" +
        (block.problem == 0 ? "; use a handle returned by minimize() or subject_to()"
                            : "; the " + std::string(block.residual) + " was removed or belongs to another problem"));
  return pools_[std::size_t(block.pool)].index_of_id[std::size_t(block.id)];
}

void Problem::remove(const Block& block) { remove_block_at(block.pool, index_of(block, "remove")); }

void Problem::remove_block_at(int pool_index, int index) {
  Pool& pool = pools_[std::size_t(pool_index)];
  const int* ids = pool.base().variables(index);
  for (int s = 0; s < pool.base().arity(); ++s) --variables_[std::size_t(ids[s])].readers;
  pool.base().remove(index);
  const int id = pool.id_of_index[std::size_t(index)], last = pool.id_of_index.back();
  pool.id_of_index[std::size_t(index)] = last;
  pool.id_of_index.pop_back();
  pool.index_of_id[std::size_t(last)] = index;
  pool.index_of_id[std::size_t(id)] = -1;
  pool.ids.release(id);
  ++revision_;
}

detail::SoftPoolBase& Problem::soft_pool_of(const Block& block, const char* caller) const {
  index_of(block, caller);
  const Pool& pool = pools_[std::size_t(block.pool)];
  if (!pool.soft)
    throw BadInputError(std::string(caller) + ": " + std::string(pool.hard->name()) +
                        " is a hard block (constraint), but a soft block (cost) is needed");
  return *pool.soft;
}

detail::HardPoolBase& Problem::hard_pool_of(const Block& block, const char* caller) const {
  index_of(block, caller);
  const Pool& pool = pools_[std::size_t(block.pool)];
  if (!pool.hard)
    throw BadInputError(std::string(caller) + ": " + std::string(pool.soft->name()) +
                        " is a soft block (cost), but a hard block (constraint) is needed");
  return *pool.hard;
}

double Problem::weight(const Block& block) const {
  return soft_pool_of(block, "weight").weight(index_of(block, "weight"));
}

Gaussian Problem::noise(const Block& block) const {
  return soft_pool_of(block, "noise").noise(index_of(block, "noise"));
}

void Problem::set_noise(const Block& block, const Gaussian& noise) {
  detail::SoftPoolBase& pool = soft_pool_of(block, "set_noise");
  check_noise(pool.name(), pool.dim(), noise);
  pool.set_noise(index_of(block, "set_noise"), noise);
  ++bounds_revision_;
}

Loss Problem::loss(const Block& block) const { return soft_pool_of(block, "loss").loss(index_of(block, "loss")); }

void Problem::set_loss(const Block& block, const Loss& loss) {
  detail::SoftPoolBase& pool = soft_pool_of(block, "set_loss");
  check_loss(pool.name(), loss);
  pool.set_loss(index_of(block, "set_loss"), loss);
  ++bounds_revision_;
}

std::vector<Block> Problem::soft_blocks_reading(std::span<const int> variable_ids) const {
  return blocks_reading(variable_ids, false);
}

std::vector<Block> Problem::hard_blocks_reading(std::span<const int> variable_ids) const {
  return blocks_reading(variable_ids, true);
}

std::vector<Block> Problem::blocks_reading(std::span<const int> variable_ids, bool hard) const {
  std::vector<char> marked(variables_.size(), 0);
  for (const int id : variable_ids) {
    info(id);  // throws if there is no such variable
    marked[std::size_t(id)] = 1;
  }
  std::vector<Block> blocks;
  for (std::size_t p = 0; p < pools_.size(); ++p) {
    const Pool& pool = pools_[p];
    if (bool(pool.hard) != hard || !pool.type) continue;
    for (int i = 0; i < pool.base().size(); ++i)
      if (pool.base().reads(i, marked)) blocks.push_back(handle(static_cast<int>(p), pool.id_of_index[std::size_t(i)]));
  }
  return blocks;
}

void Problem::scale_losses(double factor) {
  if (!(factor > 0) || !std::isfinite(factor))
    throw BadInputError("scale_losses: the factor " + std::to_string(factor) + " is not positive and finite");
  loss_scale_ = factor;
  for (const auto& pool : pools_)
    if (pool.soft) pool.soft->loss_scale = factor;
}

std::optional<double> Problem::convex_loss_scale() const {
  std::optional<double> largest;  // an empty optional compares less than any number
  for (const auto& pool : pools_)
    if (pool.soft) largest = std::max(largest, pool.soft->convex_loss_scale());
  return largest;
}

int Problem::num_soft_blocks() const {
  int n = 0;
  for (const auto& pool : pools_) n += pool.soft ? pool.soft->size() : 0;
  return n;
}

int Problem::num_hard_blocks() const {
  int n = 0;
  for (const auto& pool : pools_) n += pool.hard ? pool.hard->size() : 0;
  return n;
}

Problem::Size Problem::size() const {
  Size size{0, 0, 0};
  for (const auto& v : variables_) size.unknowns += v.is_free() ? v.dof : 0;
  for (const auto& pool : pools_) {
    if (!pool.hard) continue;
    const auto dim = std::size_t(pool.hard->dim()), blocks = std::size_t(pool.hard->size());
    for (std::size_t i = 0; i < blocks; ++i) {
      bool free = false;
      for (int s = 0; s < pool.hard->arity(); ++s)
        free = free || !variables_[std::size_t(pool.hard->variables(static_cast<int>(i))[s])].fixed;
      for (std::size_t row = i * dim; free && row < (i + 1) * dim; ++row)
        ++(pool.hard->lower()[row] == pool.hard->upper()[row] ? size.equalities : size.inequalities);
    }
  }
  return size;
}

Eigen::VectorXd Problem::multipliers(const Block& block) const {
  const int index = index_of(block, "multipliers");
  const detail::HardPoolBase& pool = hard_pool_of(block, "multipliers");
  return Eigen::Map<const Eigen::VectorXd>(pool.multipliers().data() + std::ptrdiff_t(index) * pool.dim(), pool.dim());
}

void Problem::set_multipliers(const Block& block, const Eigen::VectorXd& multipliers) {
  const int index = index_of(block, "set_multipliers");
  detail::HardPoolBase& pool = hard_pool_of(block, "set_multipliers");
  if (multipliers.size() != pool.dim() || !multipliers.allFinite())
    throw BadInputError("set_multipliers: " + std::string(pool.name()) + " needs " + std::to_string(pool.dim()) +
                        " finite multipliers, one per row");
  pool.set_multipliers(index, multipliers.data());
}

void Problem::set_bounds(const Block& block, int rows, const double* lower, const double* upper) {
  const int index = index_of(block, "set_bounds");
  detail::HardPoolBase& pool = hard_pool_of(block, "set_bounds");
  if (rows != pool.dim())
    throw BadInputError("set_bounds: " + std::string(pool.name()) + " has " + std::to_string(pool.dim()) +
                        " rows, but there are bounds for " + std::to_string(rows));
  check_bounds(pool.name(), rows, lower, upper);
  pool.set_bounds(index, lower, upper);
  ++bounds_revision_;
}

Bounds<Eigen::Dynamic> Problem::bounds(const Block& block) const {
  const detail::HardPoolBase& pool = hard_pool_of(block, "bounds");
  const Eigen::Index first = Eigen::Index(index_of(block, "bounds")) * pool.dim();
  return {Eigen::Map<const Eigen::VectorXd>(pool.lower().data() + first, pool.dim()),
          Eigen::Map<const Eigen::VectorXd>(pool.upper().data() + first, pool.dim())};
}

void Problem::set_bounds(const Block& block, const UniformBounds& bounds) {
  const std::size_t rows = std::size_t(hard_pool_of(block, "set_bounds").dim());
  const std::vector<double> lower(rows, bounds.lower), upper(rows, bounds.upper);
  set_bounds(block, int(rows), lower.data(), upper.data());
}

void Problem::check_bounds(std::string_view name, int rows, const double* lower, const double* upper) {
  for (int i = 0; i < rows; ++i)
    if (!(lower[i] <= upper[i]) || lower[i] == HUGE_VAL || upper[i] == -HUGE_VAL)
      throw BadInputError(std::string(name) + ": the lower bound " + std::to_string(lower[i]) +
                          " and the upper bound " + std::to_string(upper[i]) + " have no finite number between them");
}

Block Problem::add_soft(const detail::ResidualType& type, const void* residual, const int* slots, const Gaussian& noise,
                        const Loss& loss) {
  check_noise(type.functions.name, type.functions.dim, noise);
  check_loss(type.functions.name, loss);
  const int index = pool_of(type);
  static_cast<detail::SoftPool&>(*pools_[std::size_t(index)].soft).add(residual, slots, noise, loss);
  return new_block(index);
}

Block Problem::add_hard(const detail::ResidualType& type, const void* residual, const int* slots, const double* lower,
                        const double* upper) {
  check_bounds(type.functions.name, type.functions.dim, lower, upper);
  const int index = pool_of(type);
  static_cast<detail::HardPool&>(*pools_[std::size_t(index)].hard).add(residual, slots, lower, upper);
  return new_block(index);
}

void Problem::set_residual(const Block& block, const detail::ResidualFunctions& functions, const void* residual) {
  const int index = index_of(block, "set_residual");
  const Pool& pool = pools_[std::size_t(block.pool)];
  if (!pool.type || pool.type->type() != *functions.type)
    throw BadInputError("set_residual: the residual of the block is " + std::string(pool.base().name()) +
                        ", which is not of the given type (" + std::string(functions.name) + ")");
  pool.base().set_residual(index, residual);
  ++bounds_revision_;
}

int Problem::pool_of(const detail::ResidualType& type) {
  const std::tuple key(std::type_index(type.type()), type.hard, type.made_at_run_time ? &type : nullptr);
  if (const auto at = pool_of_type_.find(key); at != pool_of_type_.end()) return at->second;
  std::vector<detail::StateStoreBase*> stores(std::size_t(type.functions.arity));
  type.stores_of(type, *this, stores.data());
  const int index = static_cast<int>(pools_.size());
  Pool pool;
  pool.type = &type;
  if (type.hard) {
    pool.hard = std::make_unique<detail::HardPool>(type.functions, stores);
  } else {
    pool.soft = std::make_unique<detail::SoftPool>(type.functions, stores);
    pool.soft->loss_scale = loss_scale_;
  }
  pools_.push_back(std::move(pool));
  pool_of_type_.emplace(key, index);
  return index;
}

}  // namespace tandem
