#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>

#include <tandem/problem/program.hpp>

namespace tandem {

bool Program::is_current() const {
  if (problem_.revision_ != revision_) return false;
  if (problem_.bounds_revision_ == bounds_revision_) return true;
  for (std::size_t p = 0; p < soft_bounds_.size(); ++p)
    if (soft_bounds_[p] && !problem_.pools_[p].soft->bounded_rows()) return false;
  return true;
}

void Program::check_unchanged() const {
  if (!is_current())
    throw Error(
        "variables or blocks have joined or left the problem, or a soft bound has got a loss, "
        "since its Program was made: make a new one");
}

const detail::PoolBase& Program::pool(std::size_t p) const {
  return costs_[p] ? static_cast<const detail::PoolBase&>(*costs_[p]) : *rows_[p];
}

void Program::take_point() {
  check_unchanged();
  if (problem_.value_revision_ != value_revision_)
    throw Error("the variables' values were changed while a Program was at work on them: reset() it first");
  if (problem_.point_of_ != this) move_to(delta_);
}

void Program::move_to(const Eigen::VectorXd& delta) {
  check_unchanged();
  for (auto& [type, store] : problem_.stores_) store->charted = false;
  over_states([&](detail::StateStoreBase& store, int begin, int end) { store.move(delta.data(), offset_, begin, end); },
              [&](int lane) {
                const auto [first, size] = unknowns_of(lane);
                if (&delta != &delta_) delta_.segment(first, size) = delta.segment(first, size);
              });
  problem_.point_of_ = this;
  moved_ = true;
}

void Program::recenter() {
  take_point();
  for (auto& [type, store] : problem_.stores_) store->charted = false;
  over_states([](detail::StateStoreBase& store, int begin, int end) { store.recenter(begin, end); },
              [this](int lane) {
                const auto [first, size] = unknowns_of(lane);
                delta_.segment(first, size).setZero();
              });
  value_revision_ = ++problem_.value_revision_;
  moved_ = false;
}

void Program::keep() {
  for (auto& [type, store] : problem_.stores_) store->keep();
}

void Program::restore() {
  check_unchanged();
  for (auto& [type, store] : problem_.stores_) store->restore();
  ++problem_.value_revision_;
  reset();
}

void Program::reset() {
  check_unchanged();
  for (auto& [type, store] : problem_.stores_) store->reset();
  value_revision_ = problem_.value_revision_;
  if (bounds_revision_ != problem_.bounds_revision_) read_bounds();
  problem_.point_of_ = this;
  delta_.setZero();
  moved_ = false;
}

double Program::largest_angle() const {
  double largest = 0;
  for (const auto& [type, store] : problem_.stores_) largest = std::max(largest, store->largest_angle());
  return largest;
}

void Program::chart_if_moved() {
  take_point();
  if (!moved_) return;
  for (auto& [type, store] : problem_.stores_) store->begin_charts();
  over_states([](detail::StateStoreBase& store, int begin, int end) { store.chart_point(begin, end); });
  moved_ = false;
}

template <class F>
double Program::over_blocks(F f) const {
  return over_blocks(f, [](int) {});
}

template <class F, class Begin>
double Program::over_blocks(F f, Begin begin) const {
  const auto of_lane = [&](int lane) {
    double sum = 0;
    std::size_t at = std::size_t(lane);
    // As many pools as there were: a block that was refused since may have left one more, empty.
    for (std::size_t p = 0; p < placement_.size(); ++p, at += std::size_t(num_lanes_) + 2)
      if (first_of_lane_[at] < first_of_lane_[at + 1]) sum += f(p, first_of_lane_[at], first_of_lane_[at + 1]);
    return sum;
  };
  std::array<double, detail::kMostLanes> sums;
  lanes_.run(num_lanes_, [&](int lane) {
    begin(lane);
    sums[std::size_t(lane)] = of_lane(lane);
  });
  return std::accumulate(sums.begin(), sums.begin() + num_lanes_, 0.0) + of_lane(num_lanes_);
}

template <class F>
double Program::over_hard_blocks(F f) const {
  return over_blocks([&](std::size_t p, int begin, int end) {
    if (rows_[p]) f(*rows_[p], p, begin, end);
    return 0.0;
  });
}

template <class F>
void Program::over_states(F f) {
  over_states(f, [](int) {});
}

template <class F, class Begin>
void Program::over_states(F f, Begin begin) {
  lanes_.run(num_lanes_, [&](int lane) {
    begin(lane);
    for (auto& [type, store] : problem_.stores_) {
      const std::int64_t slots = store->size();
      f(*store, int(slots * lane / num_lanes_), int(slots * (lane + 1) / num_lanes_));
    }
  });
}

std::pair<int, int> Program::blocks_of(int lane) const {
  const auto first = [&](int part) {
    return int((std::int64_t(part) * hessian_.num_blocks() + num_lanes_ - 1) / num_lanes_);
  };
  return {first(lane), first(lane + 1)};
}

std::pair<int, int> Program::unknowns_of(int lane) const {
  const auto [first, end] = blocks_of(lane);
  const int unknown = hessian_.first[std::size_t(first)];
  return {unknown, hessian_.first[std::size_t(end)] - unknown};
}

void Program::set_zero_part(int lane, Eigen::VectorXd& hessian) const {
  const auto [first, end] = blocks_of(lane);
  for (int block = first; block < end; ++block)
    hessian.segment(hessian_.value_start[std::size_t(block)], hessian_.height(block) * hessian_.width(block)).setZero();
}

double Program::cost() {
  take_point();
  return over_blocks([this](std::size_t p, int begin, int end) {
    return costs_[p] ? costs_[p]->cost(placement_[p], begin, end) : 0.0;
  });
}

double Program::cost_of_rows(const Eigen::VectorXd& c) const {
  double total = 0;
  for (Eigen::Index i = 0; i < c.size(); ++i) {
    if (soft_weights_[i] == 0) continue;  // a hard row, finite or not
    const double d = std::max({lower_[i] - c[i], c[i] - upper_[i], 0.0});
    total += 0.5 * soft_weights_[i] * d * d;
  }
  return total;
}

double Program::gradient(Eigen::VectorXd& gradient) {
  chart_if_moved();
  return accumulate(gradient, nullptr);
}

double Program::linearize(Eigen::VectorXd& gradient, Eigen::VectorXd& hessian) {
  chart_if_moved();
  return accumulate(gradient, &hessian);
}

void Program::leave_charts() {
  take_point();
  for (auto& [type, store] : problem_.stores_) store->charted = false;
  moved_ = true;
}

double Program::gradient_at_point(Eigen::VectorXd& gradient) {
  leave_charts();
  return accumulate(gradient, nullptr);
}

double Program::linearize_at_point(Eigen::VectorXd& gradient, Eigen::VectorXd& hessian) {
  leave_charts();
  return accumulate(gradient, &hessian);
}

double Program::accumulate(Eigen::VectorXd& gradient, Eigen::VectorXd* hessian) {
  double* H = hessian ? hessian->data() : nullptr;
  return over_blocks(
      [&](std::size_t p, int begin, int end) {
        return costs_[p] ? costs_[p]->accumulate(placement_[p], begin, end, gradient.data(), H) : 0.0;
      },
      [&](int lane) {
        const auto [first, size] = unknowns_of(lane);
        gradient.segment(first, size).setZero();
        if (H) set_zero_part(lane, *hessian);
      });
}

void Program::constraints(Eigen::VectorXd& c) {
  take_point();
  over_hard_blocks([&](const detail::HardPoolBase& pool, std::size_t p, int begin, int end) {
    pool.values(placement_[p], begin, end, c.data() + first_row_[p]);
  });
}

void Program::constraint_jacobian(Eigen::VectorXd& values) {
  chart_if_moved();
  over_hard_blocks([&](const detail::HardPoolBase& pool, std::size_t p, int begin, int end) {
    pool.jacobian(placement_[p], begin, end, nullptr, values.data());
  });
}

void Program::linearize_constraints(Eigen::VectorXd& c, Eigen::VectorXd& jacobian) {
  chart_if_moved();
  evaluate_constraints(c, jacobian);
}

void Program::linearize_constraints_at_point(Eigen::VectorXd& c, Eigen::VectorXd& jacobian) {
  leave_charts();
  evaluate_constraints(c, jacobian);
}

void Program::evaluate_constraints(Eigen::VectorXd& c, Eigen::VectorXd& jacobian) {
  over_hard_blocks([&](const detail::HardPoolBase& pool, std::size_t p, int begin, int end) {
    pool.jacobian(placement_[p], begin, end, c.data() + first_row_[p], jacobian.data());
  });
}

void Program::add_constraint_hessian(const Eigen::VectorXd& weights, const Eigen::VectorXd& jacobian,
                                     Eigen::VectorXd& hessian) const {
  over_hard_blocks([&](const detail::HardPoolBase& pool, std::size_t p, int begin, int end) {
    pool.accumulate(placement_[p], begin, end, weights.data() + first_row_[p], jacobian.data(), hessian.data());
  });
}

void Program::multipliers(Eigen::VectorXd& y) const {
  for (std::size_t p = 0; p < rows_.size(); ++p)
    if (rows_[p]) std::copy(rows_[p]->multipliers().begin(), rows_[p]->multipliers().end(), y.data() + first_row_[p]);
}

void Program::set_multipliers(const Eigen::VectorXd& y) {
  for (std::size_t p = 0; p < rows_.size(); ++p) {
    detail::HardPoolBase* hard = problem_.pools_[p].hard.get();
    const double* from = y.data() + first_row_[p];
    for (int i = 0; hard && i < hard->size(); ++i, from += hard->dim()) hard->set_multipliers(i, from);
  }
}

Program::Stiffness Program::stiffness(const Eigen::VectorXd& v, const Eigen::VectorXd& row_weights) {
  chart_if_moved();
  Stiffness total{0, 0};
  for (std::size_t p = 0; p < placement_.size(); ++p)
    pool(p).add_stiffness(placement_[p], v.data(), row_weights.data() + first_row_[p], total.along, total.scale);
  return total;
}

void Program::exact_hessian(double factor, const Eigen::VectorXd& multipliers, Eigen::VectorXd& hessian) {
  second_derivatives(detail::Curvature::all, factor, multipliers, hessian);
}

void Program::curvature(const Eigen::VectorXd& multipliers, Eigen::VectorXd& hessian) {
  second_derivatives(detail::Curvature::beyond_gauss_newton, 1.0, multipliers, hessian);
}

void Program::second_derivatives(detail::Curvature wanted, double factor, const Eigen::VectorXd& multipliers,
                                 Eigen::VectorXd& hessian) {
  chart_if_moved();
  point_gradient_.setZero();
  over_blocks(
      [&](std::size_t p, int begin, int end) {
        const double* lambda = rows_[p] ? multipliers.data() + first_row_[p] : nullptr;
        pool(p).add_exact_hessian(placement_[p], begin, end, wanted, rows_[p] ? 1.0 : factor, lambda,
                                  point_gradient_.data(), hessian.data());
        return 0.0;
      },
      [&](int lane) { set_zero_part(lane, hessian); });
  over_states([&](const detail::StateStoreBase& store, int begin, int end) {
    store.add_chart_curvature(point_gradient_.data(), block_of_variable_, hessian_, begin, end, hessian.data());
  });
}

Program::Violation Program::violation(const Eigen::VectorXd& c) const {
  Violation worst{0.0, -1};
  for (int i = 0; i < num_rows(); ++i) {
    if (soft_weights_[i] > 0 && std::isfinite(c[i])) continue;
    const double v = std::max(lower_[i] - c[i], c[i] - upper_[i]);
    if (v > worst.size || !std::isfinite(c[i])) worst = {std::isfinite(c[i]) ? v : HUGE_VAL, i};
  }
  return worst;
}

Program::Violation Program::fixed_violation(const Eigen::VectorXd& c) const {
  Violation worst{0.0, -1};
  for (const auto& f : fixed_rows_) {
    const double v = std::max(f.lower - c[f.row], c[f.row] - f.upper);
    if (v > worst.size) worst = {v, f.row};
  }
  return worst;
}

std::string Program::describe_row(int row) const {
  for (const auto* pool : rows_) {
    if (!pool) continue;
    const int rows = pool->size() * pool->dim();
    if (row < rows) return problem_.describe(*pool, row / pool->dim());
    row -= rows;
  }
  return {};
}

std::string Program::describe_bad_block() {
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(num_unknowns());
  chart_if_moved();
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

Program::Unknown Program::describe_unknown(int unknown) const {
  const auto it = std::upper_bound(hessian_.first.begin(), hessian_.first.end(), unknown) - 1;
  const int id = variable_of_block_[std::size_t(it - hessian_.first.begin())];
  const auto& variable = problem_.variables_[std::size_t(id)];
  const int entry = unknown - *it;
  int turns = 0, turns_before = 0;
  for (int i = 0; i < variable.dof; ++i) {
    turns += variable.store->turns(i);
    turns_before += i < entry && variable.store->turns(i);
  }
  static constexpr std::array<const char*, 3> axes{"x", "y", "z"};
  std::string direction;
  if (variable.store->turns(entry)) {
    direction = turns == 1 ? "heading" : std::string("rotation about ") + axes[std::size_t(turns_before) % 3];
  } else if (entry < 3) {
    direction = axes[std::size_t(entry)];
  } else {
    direction = "entry " + std::to_string(entry) + " of its tangent";
  }
  return {variable.name, entry, direction};
}

}  // namespace tandem
