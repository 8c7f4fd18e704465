#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>

#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem {

bool NlpEvaluator::is_current() const {
  if (problem_.serial_ != serial_ || problem_.revision_ != revision_) return false;
  if (problem_.bounds_revision_ == bounds_revision_) return true;
  for (std::size_t p = 0; p < soft_bounds_.size(); ++p)
    if (soft_bounds_[p] && !problem_.pools_[p].soft->bounded_rows()) return false;
  return true;
}

void NlpEvaluator::check_unchanged() const {
  if (!is_current())
    throw StaleHandleError(
        "the problem has changed since its NlpEvaluator was made (variables or blocks were added, removed or fixed, "
        "or a soft bound got a loss); make a new NlpEvaluator");
}

const detail::PoolBase& NlpEvaluator::pool(std::size_t p) const {
  return costs_[p] ? static_cast<const detail::PoolBase&>(*costs_[p]) : *rows_[p];
}

void NlpEvaluator::claim_point() {
  check_unchanged();
  if (problem_.value_revision_ != value_revision_)
    throw StaleHandleError(
        "the variables' values were changed since the last reset() of this NlpEvaluator; call reset() first");
  if (problem_.point_owner_ != this) move_to(delta_);
}

void NlpEvaluator::move_to(const Eigen::VectorXd& delta) {
  check_unchanged();
  for (auto& [type, store] : problem_.stores_) store->charted = false;
  over_states([&](detail::StateStoreBase& store, int begin, int end) { store.move(delta.data(), offset_, begin, end); },
              [&](int task) {
                const auto [first, size] = unknowns_of(task);
                if (&delta != &delta_) delta_.segment(first, size) = delta.segment(first, size);
              });
  problem_.point_owner_ = this;
  moved_ = true;
}

void NlpEvaluator::recenter() {
  claim_point();
  for (auto& [type, store] : problem_.stores_) store->charted = false;
  over_states([](detail::StateStoreBase& store, int begin, int end) { store.recenter(begin, end); },
              [this](int task) {
                const auto [first, size] = unknowns_of(task);
                delta_.segment(first, size).setZero();
              });
  value_revision_ = ++problem_.value_revision_;
  moved_ = false;
}

void NlpEvaluator::save() {
  check_unchanged();
  for (auto& [type, store] : problem_.stores_) store->save();
}

void NlpEvaluator::restore() {
  check_unchanged();
  for (auto& [type, store] : problem_.stores_) store->restore();
  ++problem_.value_revision_;
  reset();
}

void NlpEvaluator::reset() {
  check_unchanged();
  for (auto& [type, store] : problem_.stores_) store->reset();
  value_revision_ = problem_.value_revision_;
  if (bounds_revision_ != problem_.bounds_revision_) read_bounds();
  problem_.point_owner_ = this;
  delta_.setZero();
  moved_ = false;
}

double NlpEvaluator::largest_angle() const {
  check_unchanged();
  double largest = 0;
  for (const auto& [type, store] : problem_.stores_) largest = std::max(largest, store->largest_angle());
  return largest;
}

void NlpEvaluator::update_charts() {
  claim_point();
  if (!moved_) return;
  for (auto& [type, store] : problem_.stores_) store->begin_charts();
  over_states([](detail::StateStoreBase& store, int begin, int end) { store.chart_point(begin, end); });
  moved_ = false;
}

template <class F>
double NlpEvaluator::over_blocks(F f) const {
  return over_blocks(f, [](int) {});
}

template <class F, class Begin>
double NlpEvaluator::over_blocks(F f, Begin begin) const {
  const auto sum_of_task = [&](int task) {
    double sum = 0;
    std::size_t at = std::size_t(task);
    // Pools at construction: a block that was rejected since then may have left one more, empty pool.
    for (std::size_t p = 0; p < placement_.size(); ++p, at += std::size_t(num_tasks_) + 2)
      if (first_of_task_[at] < first_of_task_[at + 1]) sum += f(p, first_of_task_[at], first_of_task_[at + 1]);
    return sum;
  };
  std::array<double, detail::kMaxTasks> sums;
  task_runner_.run(num_tasks_, [&](int task) {
    begin(task);
    sums[std::size_t(task)] = sum_of_task(task);
  });
  return std::accumulate(sums.begin(), sums.begin() + num_tasks_, 0.0) + sum_of_task(num_tasks_);
}

template <class F>
double NlpEvaluator::over_hard_blocks(F f) const {
  return over_blocks([&](std::size_t p, int begin, int end) {
    if (rows_[p]) f(*rows_[p], p, begin, end);
    return 0.0;
  });
}

template <class F>
void NlpEvaluator::over_states(F f) {
  over_states(f, [](int) {});
}

template <class F, class Begin>
void NlpEvaluator::over_states(F f, Begin begin) {
  task_runner_.run(num_tasks_, [&](int task) {
    begin(task);
    for (auto& [type, store] : problem_.stores_) {
      const std::int64_t slots = store->size();
      f(*store, int(slots * task / num_tasks_), int(slots * (task + 1) / num_tasks_));
    }
  });
}

void NlpEvaluator::prepare(bool jacobians) const {
  for (std::size_t p = 0; p < placement_.size(); ++p)
    if (const detail::ResidualType* type = problem_.pools_[p].type; type && type->prepare && pool(p).size() > 0)
      type->prepare(pool(p), jacobians);
}

std::pair<int, int> NlpEvaluator::blocks_of(int task) const {
  const auto first = [&](int part) {
    return int((std::int64_t(part) * hessian_.num_blocks() + num_tasks_ - 1) / num_tasks_);
  };
  return {first(task), first(task + 1)};
}

std::pair<int, int> NlpEvaluator::unknowns_of(int task) const {
  const auto [first, end] = blocks_of(task);
  const int unknown = hessian_.first[std::size_t(first)];
  return {unknown, hessian_.first[std::size_t(end)] - unknown};
}

void NlpEvaluator::set_zero_part(int task, Eigen::VectorXd& hessian) const {
  const auto [first, end] = blocks_of(task);
  for (int block = first; block < end; ++block)
    hessian.segment(hessian_.value_start[std::size_t(block)], hessian_.height(block) * hessian_.width(block)).setZero();
}

double NlpEvaluator::cost() {
  claim_point();
  prepare(false);
  return over_blocks([this](std::size_t p, int begin, int end) {
    return costs_[p] ? costs_[p]->cost(placement_[p], begin, end) : 0.0;
  });
}

double NlpEvaluator::cost_of_rows(const Eigen::VectorXd& c) const {
  double total = 0;
  for (Eigen::Index i = 0; i < c.size(); ++i) {
    if (soft_weights_[i] == 0) continue;  // a hard row, which may be infinite
    const double d = std::max({lower_[i] - c[i], c[i] - upper_[i], 0.0});
    total += 0.5 * soft_weights_[i] * d * d;
  }
  return total;
}

double NlpEvaluator::gradient(Eigen::VectorXd& gradient) {
  update_charts();
  return accumulate(gradient, nullptr);
}

double NlpEvaluator::linearize(Eigen::VectorXd& gradient, Eigen::VectorXd& hessian) {
  update_charts();
  return accumulate(gradient, &hessian);
}

void NlpEvaluator::drop_charts() {
  claim_point();
  for (auto& [type, store] : problem_.stores_) store->charted = false;
  moved_ = true;
}

double NlpEvaluator::gradient_at_point(Eigen::VectorXd& gradient) {
  drop_charts();
  return accumulate(gradient, nullptr);
}

double NlpEvaluator::linearize_at_point(Eigen::VectorXd& gradient, Eigen::VectorXd& hessian) {
  drop_charts();
  return accumulate(gradient, &hessian);
}

double NlpEvaluator::accumulate(Eigen::VectorXd& gradient, Eigen::VectorXd* hessian) {
  double* H = hessian ? hessian->data() : nullptr;
  prepare(true);
  return over_blocks(
      [&](std::size_t p, int begin, int end) {
        return costs_[p] ? costs_[p]->accumulate(placement_[p], begin, end, gradient.data(), H) : 0.0;
      },
      [&](int task) {
        const auto [first, size] = unknowns_of(task);
        gradient.segment(first, size).setZero();
        if (H) set_zero_part(task, *hessian);
      });
}

void NlpEvaluator::constraints(Eigen::VectorXd& c) {
  claim_point();
  prepare(false);
  over_hard_blocks([&](const detail::HardPoolBase& pool, std::size_t p, int begin, int end) {
    pool.values(placement_[p], begin, end, c.data() + first_row_[p]);
  });
}

void NlpEvaluator::constraint_jacobian(Eigen::VectorXd& values) {
  update_charts();
  prepare(true);
  over_hard_blocks([&](const detail::HardPoolBase& pool, std::size_t p, int begin, int end) {
    pool.jacobian(placement_[p], begin, end, nullptr, values.data());
  });
}

void NlpEvaluator::linearize_constraints(Eigen::VectorXd& c, Eigen::VectorXd& jacobian) {
  update_charts();
  evaluate_constraints(c, jacobian);
}

void NlpEvaluator::linearize_constraints_at_point(Eigen::VectorXd& c, Eigen::VectorXd& jacobian) {
  drop_charts();
  evaluate_constraints(c, jacobian);
}

void NlpEvaluator::evaluate_constraints(Eigen::VectorXd& c, Eigen::VectorXd& jacobian) {
  prepare(true);
  over_hard_blocks([&](const detail::HardPoolBase& pool, std::size_t p, int begin, int end) {
    pool.jacobian(placement_[p], begin, end, c.data() + first_row_[p], jacobian.data());
  });
}

void NlpEvaluator::add_constraint_hessian(const Eigen::VectorXd& weights, const Eigen::VectorXd& jacobian,
                                          Eigen::VectorXd& hessian) const {
  check_unchanged();
  over_hard_blocks([&](const detail::HardPoolBase& pool, std::size_t p, int begin, int end) {
    pool.accumulate(placement_[p], begin, end, weights.data() + first_row_[p], jacobian.data(), hessian.data());
  });
}

void NlpEvaluator::multipliers(Eigen::VectorXd& y) const {
  check_unchanged();
  for (std::size_t p = 0; p < rows_.size(); ++p)
    if (rows_[p]) std::copy(rows_[p]->multipliers().begin(), rows_[p]->multipliers().end(), y.data() + first_row_[p]);
}

void NlpEvaluator::set_multipliers(const Eigen::VectorXd& y) {
  check_unchanged();
  for (std::size_t p = 0; p < rows_.size(); ++p) {
    detail::HardPoolBase* hard = problem_.pools_[p].hard.get();
    const double* from = y.data() + first_row_[p];
    for (int i = 0; hard && i < hard->size(); ++i, from += hard->dim()) hard->set_multipliers(i, from);
  }
}

NlpEvaluator::Stiffness NlpEvaluator::stiffness(const Eigen::VectorXd& v, const Eigen::VectorXd& row_weights) {
  update_charts();
  Stiffness total{0, 0};
  for (std::size_t p = 0; p < placement_.size(); ++p)
    pool(p).add_stiffness(placement_[p], v.data(), row_weights.data() + first_row_[p], total.along, total.scale);
  return total;
}

void NlpEvaluator::exact_hessian(double factor, const Eigen::VectorXd& multipliers, Eigen::VectorXd& hessian) {
  second_derivatives(detail::Curvature::all, factor, multipliers, hessian);
}

void NlpEvaluator::curvature(const Eigen::VectorXd& multipliers, Eigen::VectorXd& hessian) {
  second_derivatives(detail::Curvature::beyond_gauss_newton, 1.0, multipliers, hessian);
}

void NlpEvaluator::second_derivatives(detail::Curvature wanted, double factor, const Eigen::VectorXd& multipliers,
                                      Eigen::VectorXd& hessian) {
  update_charts();
  point_gradient_.setZero();
  over_blocks(
      [&](std::size_t p, int begin, int end) {
        const double* lambda = rows_[p] ? multipliers.data() + first_row_[p] : nullptr;
        pool(p).add_exact_hessian(placement_[p], begin, end, wanted, rows_[p] ? 1.0 : factor, lambda,
                                  point_gradient_.data(), hessian.data());
        return 0.0;
      },
      [&](int task) { set_zero_part(task, hessian); });
  over_states([&](const detail::StateStoreBase& store, int begin, int end) {
    store.add_chart_curvature(point_gradient_.data(), block_of_variable_, hessian_, begin, end, hessian.data());
  });
}

NlpEvaluator::Violation NlpEvaluator::violation(const Eigen::VectorXd& c) const {
  Violation worst{0.0, -1};
  for (int i = 0; i < num_rows(); ++i) {
    if (soft_weights_[i] > 0 && std::isfinite(c[i])) continue;
    const double v = std::max(lower_[i] - c[i], c[i] - upper_[i]);
    if (v > worst.size || !std::isfinite(c[i])) worst = {std::isfinite(c[i]) ? v : HUGE_VAL, i};
  }
  return worst;
}

NlpEvaluator::Violation NlpEvaluator::fixed_violation(const Eigen::VectorXd& c) const {
  Violation worst{0.0, -1};
  for (const auto& f : fixed_rows_) {
    const double v = std::max(f.lower - c[f.row], c[f.row] - f.upper);
    if (v > worst.size) worst = {v, f.row};
  }
  return worst;
}

std::string NlpEvaluator::describe_row(int row) const {
  check_unchanged();
  for (const auto* pool : rows_) {
    if (!pool) continue;
    const int rows = pool->size() * pool->dim();
    if (row < rows) return problem_.describe(*pool, row / pool->dim());
    row -= rows;
  }
  return {};
}

std::string NlpEvaluator::describe_nonfinite_block() {
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(num_unknowns());
  update_charts();
  for (std::size_t p = 0; p < costs_.size(); ++p) {
    const auto* pool = costs_[p];
    for (int k = 0; pool && k < pool->size(); ++k) {
      const int i = placement_[p].at(k);
      const double cost = pool->accumulate(placement_[p], k, k + 1, gradient.data(), nullptr);
      bool finite = std::isfinite(cost);
      for (int s = 0; s < pool->arity(); ++s)
        if (const int id = pool->variables(i)[s]; offset_[std::size_t(id)] >= 0)
          finite = finite &&
                   gradient.segment(offset_[std::size_t(id)], problem_.variables_[std::size_t(id)].dof).allFinite();
      if (!finite) return problem_.describe(*pool, i);
    }
  }
  return {};
}

NlpEvaluator::Unknown NlpEvaluator::describe_unknown(int unknown) const {
  check_unchanged();
  const auto it = std::upper_bound(hessian_.first.begin(), hessian_.first.end(), unknown) - 1;
  const int id = variable_of_block_[std::size_t(it - hessian_.first.begin())];
  const auto& variable = problem_.variables_[std::size_t(id)];
  const int entry = unknown - *it;
  int turns = 0, turns_before = 0;
  for (int i = 0; i < variable.dof; ++i) {
    turns += variable.store->is_rotation(i);
    turns_before += i < entry && variable.store->is_rotation(i);
  }
  static constexpr std::array<const char*, 3> axes{"x", "y", "z"};
  std::string direction;
  if (variable.store->is_rotation(entry)) {
    direction = turns == 1 ? "heading" : std::string("rotation about ") + axes[std::size_t(turns_before) % 3];
  } else if (entry < 3) {
    direction = axes[std::size_t(entry)];
  } else {
    direction = "tangent entry " + std::to_string(entry);
  }
  return {variable.name(), entry, direction};
}

}  // namespace tandem
