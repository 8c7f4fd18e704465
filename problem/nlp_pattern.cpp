#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/problem/soft_pool.hpp>

// Construction of an NlpEvaluator: unknowns, patterns, the location of each block in the output, and the effort of second
// derivatives.
namespace tandem {
namespace {

constexpr int kMinBlocksPerTask = 250;  // about 0.1 ms of work, much longer than starting a task takes

/// Sorts pairs of numbers below n, packed into 64 bits, by the upper half and then by the lower half. Radix sort.
void sort_pairs(std::vector<std::uint64_t>& pairs, std::size_t n) {
  std::vector<std::uint64_t> sorted(pairs.size());
  std::vector<std::size_t> at;
  for (const int half : {0, 32}) {
    const auto key = [&](std::uint64_t pair) { return std::size_t(pair >> half & 0xffffffffu); };
    at.assign(n + 1, 0);
    for (const std::uint64_t pair : pairs) ++at[key(pair) + 1];
    std::partial_sum(at.begin(), at.end(), at.begin());
    for (const std::uint64_t pair : pairs) sorted[at[key(pair)]++] = pair;
    pairs.swap(sorted);
  }
}

}  // namespace

NlpEvaluator::NlpEvaluator(Problem& problem, SoftBoundRole soft_bounds, HessianLayout layout)
    : problem_(problem),
      serial_(problem.serial_),
      revision_(problem.revision_),
      value_revision_(problem.value_revision_),
      bounds_revision_(problem.bounds_revision_) {
  const auto& variables = problem.variables_;
  offset_.resize(variables.size(), -1);
  block_of_variable_.resize(variables.size(), -1);
  for (std::size_t id = 0; id < variables.size(); ++id)
    if (variables[id].is_free()) variable_of_block_.push_back(static_cast<int>(id));
  if (variable_of_block_.empty()) throw BadInputError("the problem has no free variable");
  // IDs are reused. In the order of creation, the Hessian of a sliding window has a narrow band.
  std::sort(variable_of_block_.begin(), variable_of_block_.end(),
            [&](int a, int b) { return variables[std::size_t(a)].sequence < variables[std::size_t(b)].sequence; });
  hessian_.first.push_back(0);
  for (std::size_t k = 0; k < variable_of_block_.size(); ++k) {
    const std::size_t id = std::size_t(variable_of_block_[k]);
    block_of_variable_[id] = static_cast<int>(k);
    offset_[id] = hessian_.first.back();
    hessian_.first.push_back(hessian_.first.back() + variables[id].dof);
  }
  placement_.resize(problem.pools_.size());
  choose_rows(soft_bounds);
  compile_hessian();
  if (layout) hessian_ = layout(hessian_);
  compile_places();
  compile_constraints();
  compile_tasks();
  delta_.setZero(num_unknowns());
  point_gradient_.resize(num_unknowns());
  reset();
}

NlpEvaluator::~NlpEvaluator() {
  if (problem_.point_owner_ == this) problem_.point_owner_ = nullptr;
}

void NlpEvaluator::compile_hessian() {
  const std::size_t n = variable_of_block_.size();
  const std::vector<int>& block_of_variable = block_of_variable_;

  // Pairs of variables that a block reads together: (column, row), row ≥ column.
  std::vector<std::uint64_t> pairs;
  std::size_t max_pairs = n;
  for (const auto& p : problem_.pools_)
    max_pairs += std::size_t(p.base().size()) * std::size_t(p.base().arity() * (p.base().arity() - 1) / 2);
  pairs.reserve(max_pairs);
  for (std::size_t k = 0; k < n; ++k) pairs.push_back(k << 32 | k);
  for (const auto& p : problem_.pools_) {
    const auto& pool = p.base();
    for (int i = 0; i < pool.size(); ++i) {
      const int* ids = pool.variables(i);
      for (int a = 0; a < pool.arity(); ++a)
        for (int b = 0; b < a; ++b) {
          const int x = block_of_variable[std::size_t(ids[a])], y = block_of_variable[std::size_t(ids[b])];
          if (x < 0 || y < 0 || x == y) continue;
          pairs.push_back(std::uint64_t(std::min(x, y)) << 32 | std::uint64_t(std::max(x, y)));
        }
    }
  }
  sort_pairs(pairs, n);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());

  auto& h = hessian_;
  h.block_start.assign(n + 1, 0);
  for (const auto pair : pairs) {
    ++h.block_start[std::size_t(pair >> 32) + 1];
    h.block_row.push_back(static_cast<int>(pair & 0xffffffffu));
  }
  for (std::size_t k = 0; k < n; ++k) h.block_start[k + 1] += h.block_start[k];

  h.place_values("the problem's Hessian");
}

void NlpEvaluator::compile_places() {
  for (std::size_t p = 0; p < problem_.pools_.size(); ++p) {
    const auto& pool = problem_.pools_[p].base();
    auto& to = placement_[p];
    const int blocks = pool.size(), arity = pool.arity();
    to.offset.reserve(std::size_t(blocks) * std::size_t(arity));
    to.hessian.reserve(std::size_t(blocks) * std::size_t(arity * (arity + 1) / 2));
    for (int i = 0; i < blocks; ++i) {
      const int* ids = pool.variables(i);
      for (int a = 0; a < arity; ++a) {
        to.offset.push_back(offset_[std::size_t(ids[a])]);
        for (int b = 0; b <= a; ++b)
          to.hessian.push_back(place(block_of_variable_[std::size_t(ids[a])], block_of_variable_[std::size_t(ids[b])]));
      }
    }
  }
}

detail::HessianPlace NlpEvaluator::place(int block_a, int block_b) const {
  if (block_a < 0 || block_b < 0) return {};
  const SymmetricPattern::BlockPlace at = hessian_.find(block_a, block_b);
  return {at.first_value, at.stride, at.transposed};
}

void NlpEvaluator::choose_rows(SoftBoundRole soft_bounds) {
  for (const auto& pool : problem_.pools_) {
    const bool as_rows = pool.soft && soft_bounds == SoftBoundRole::as_rows;
    soft_bounds_.push_back(as_rows ? pool.soft->bounded_rows() : nullptr);
    rows_.push_back(pool.hard ? pool.hard.get() : soft_bounds_.back().get());
    costs_.push_back(rows_.back() ? nullptr : pool.soft.get());
  }
}

void NlpEvaluator::compile_constraints() {
  int rows = 0;
  std::size_t values = 0;
  for (const auto* pool : rows_) {
    if (!pool) continue;
    rows += pool->size() * pool->dim();
    const int columns = std::accumulate(pool->dofs(), pool->dofs() + pool->arity(), 0);
    values += std::size_t(pool->size()) * std::size_t(pool->dim() * columns);
  }
  jacobian_.row.reserve(values);
  jacobian_.column.reserve(values);
  for (Eigen::VectorXd* v : {&lower_, &upper_, &soft_weights_}) v->setZero(rows);
  int row = 0;
  first_row_.assign(problem_.pools_.size(), 0);
  for (std::size_t p = 0; p < problem_.pools_.size(); ++p) {
    first_row_[p] = row;
    if (!rows_[p]) continue;
    const auto& pool = *rows_[p];
    const int dim = pool.dim(), arity = pool.arity(), size = pool.size();
    const int *const dofs = pool.dofs(), *offset = placement_[p].offset.data();
    placement_[p].jacobian.reserve(std::size_t(size));
    for (int i = 0; i < size; ++i, offset += arity, row += dim) {
      placement_[p].jacobian.push_back(static_cast<int>(jacobian_.row.size()));
      for (int s = 0; s < arity; ++s)
        for (int c = 0; c < dofs[s] && offset[s] >= 0; ++c)
          for (int r = 0; r < dim; ++r) {
            jacobian_.row.push_back(row + r);
            jacobian_.column.push_back(offset[s] + c);
          }
      const bool fixed = static_cast<int>(jacobian_.row.size()) == placement_[p].jacobian.back();
      if (fixed && !soft_bounds_[p])
        for (int r = 0; r < dim; ++r) fixed_rows_.push_back({row + r, 0, 0});
    }
  }
  read_bounds();
}

void NlpEvaluator::read_bounds() {
  for (std::size_t p = 0; p < rows_.size(); ++p) {
    if (soft_bounds_[p]) read_soft_bounds(p);
    if (!rows_[p]) continue;
    std::copy(rows_[p]->lower().begin(), rows_[p]->lower().end(), lower_.begin() + first_row_[p]);
    std::copy(rows_[p]->upper().begin(), rows_[p]->upper().end(), upper_.begin() + first_row_[p]);
  }
  for (FixedRow& f : fixed_rows_) {
    f.lower = std::exchange(lower_[f.row], -HUGE_VAL);
    f.upper = std::exchange(upper_[f.row], HUGE_VAL);
  }
  bounds_revision_ = problem_.bounds_revision_;
}

void NlpEvaluator::read_soft_bounds(std::size_t p) {
  const detail::SoftPoolBase& pool = *problem_.pools_[p].soft;
  if (bounds_revision_ != problem_.bounds_revision_) {
    soft_bounds_[p] = pool.bounded_rows();
    rows_[p] = soft_bounds_[p].get();
  }
  for (int i = 0; i < pool.size(); ++i)
    soft_weights_.segment(first_row_[p] + i * pool.dim(), pool.dim()) = pool.noise(i).diagonal().cwiseAbs2();
}

/// Divides the variables into parts of equal size, one per task. A block that reads a single part belongs to its task.
void NlpEvaluator::compile_tasks() {
  int blocks = 0;
  for (const auto& p : problem_.pools_) blocks += p.base().size();
  num_tasks_ = std::clamp(blocks / kMinBlocksPerTask, 1, detail::kMaxTasks);
  const auto part_of = [&](int id) {  // −1 if the variable is fixed
    const std::int64_t block = block_of_variable_[std::size_t(id)];
    return block < 0 ? -1 : static_cast<int>(block * num_tasks_ / hessian_.num_blocks());
  };

  std::vector<int> task;
  for (std::size_t p = 0; p < problem_.pools_.size(); ++p) {
    const auto& pool = problem_.pools_[p].base();
    task.assign(std::size_t(pool.size()), 0);
    for (int i = 0; i < pool.size() && num_tasks_ > 1; ++i) {
      int first = num_tasks_, last = -1;
      for (int s = 0; s < pool.arity(); ++s)
        if (const int part = part_of(pool.variables(i)[s]); part >= 0) {
          first = std::min(first, part);
          last = std::max(last, part);
        }
      task[std::size_t(i)] = first < last ? num_tasks_ : std::max(last, 0);
    }
    std::vector<int>& order = placement_[p].order;
    if (!std::is_sorted(task.begin(), task.end())) {
      order.resize(task.size());
      std::iota(order.begin(), order.end(), 0);
      std::stable_sort(order.begin(), order.end(),
                       [&](int a, int b) { return task[std::size_t(a)] < task[std::size_t(b)]; });
      std::sort(task.begin(), task.end());
    }
    for (int l = 0; l <= num_tasks_ + 1; ++l)
      first_of_task_.push_back(static_cast<int>(std::lower_bound(task.begin(), task.end(), l) - task.begin()));
  }
}

bool NlpEvaluator::has_cheap_curvature() const {
  constexpr long long kCheapEvaluations = 2;  // per block
  long long blocks = 0, evaluations = 0;
  for (std::size_t p = 0; p < costs_.size(); ++p) {
    if (!costs_[p] || costs_[p]->size() == 0) continue;
    const auto* const pool = dynamic_cast<const detail::SoftPool*>(costs_[p]);  // null for a marginal prior
    const detail::ResidualType* const type = problem_.pools_[p].type;
    if (!pool || (type && type->prepare)) return false;
    blocks += pool->size();
    evaluations += pool->num_curvature_evaluations();
  }
  return evaluations <= kCheapEvaluations * blocks;
}

}  // namespace tandem
