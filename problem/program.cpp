#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <tandem/problem/program.hpp>

#ifdef TANDEM_HAS_TBB
#include <tbb/parallel_invoke.h>
#endif

namespace tandem {

bool Program::is_current() const { return problem_.revision_ == revision_; }

void Program::check_unchanged() const {
  if (!is_current())
    throw Error("variables or blocks have joined or left the problem since its Program was made: make a new one");
}

void Program::take_point() {
  check_unchanged();
  if (problem_.value_revision_ != value_revision_)
    throw Error("the variables' values were changed while a Program was at work on them: reset() it first");
  if (problem_.point_of_ != this) move_to(delta_);
}

void Program::move_to(const Eigen::VectorXd& delta) {
  check_unchanged();
  delta_ = delta;
  for (auto& [type, store] : problem_.stores_) store->move(delta_.data(), offset_);
  problem_.point_of_ = this;
  moved_ = true;
}

void Program::recenter() {
  take_point();
  for (auto& [type, store] : problem_.stores_) store->recenter();
  values_changed();
}

void Program::keep() {
  for (auto& [type, store] : problem_.stores_) store->keep();
}

void Program::restore() {
  check_unchanged();
  for (auto& [type, store] : problem_.stores_) store->restore();
  values_changed();
  reset();
}

void Program::values_changed() {
  value_revision_ = ++problem_.value_revision_;
  delta_.setZero();
  moved_ = false;
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
  for (auto& [type, store] : problem_.stores_) store->chart_point();
  moved_ = false;
}

template <class F>
double Program::in_lanes(F f) {
  if (!two_lanes_) return f(0);
#ifdef TANDEM_HAS_TBB
  // Work stealing, not a barrier: on a busy machine this thread takes the second lane too instead of waiting.
  double first = 0, second = 0;
  tbb::parallel_invoke([&] { first = f(0); }, [&] { second = f(1); });
  return first + second;
#else
  const double first = f(0);
  return first + f(1);
#endif
}

double Program::cost() {
  take_point();
  return in_lanes([this](int lane) {
    double total = 0;
    for (const auto& p : problem_.pools_)
      if (p.soft) total += p.soft->cost(first_of_lane(*p.soft, lane), first_of_lane(*p.soft, lane + 1));
    return total;
  });
}

double Program::gradient(Eigen::VectorXd& gradient) {
  chart_if_moved();
  return accumulate(gradient, nullptr);
}

double Program::linearize(Eigen::VectorXd& gradient, Eigen::VectorXd& hessian) {
  chart_if_moved();
  return accumulate(gradient, &hessian);
}

double Program::linearize_at_point(Eigen::VectorXd& gradient, Eigen::VectorXd& hessian) {
  take_point();
  for (auto& [type, store] : problem_.stores_) store->charted = false;
  moved_ = true;
  return accumulate(gradient, &hessian);
}

template <class F>
double Program::sum_in_lanes(Eigen::VectorXd& gradient, Eigen::VectorXd* hessian, F f) {
  const double sum = in_lanes([&](int lane) {
    Eigen::VectorXd& g = lane == 0 ? gradient : second_gradient_;
    Eigen::VectorXd* H = lane == 0 || !hessian ? hessian : &second_hessian_;
    g.setZero();
    if (H) H->setZero();
    // Positions count from the whole arrays' beginning; no block of the second lane has one before its tails.
    double* g_data = g.data() + g.size() - gradient.size();
    double* H_data = H ? H->data() + H->size() - hessian->size() : nullptr;
    double total = 0;
    for (std::size_t p = 0; p < problem_.pools_.size(); ++p) total += f(p, lane, g_data, H_data);
    return total;
  });
  if (two_lanes_) {
    gradient.tail(second_gradient_.size()) += second_gradient_;
    if (hessian) hessian->tail(second_hessian_.size()) += second_hessian_;
  }
  return sum;
}

double Program::accumulate(Eigen::VectorXd& gradient, Eigen::VectorXd* hessian) {
  return sum_in_lanes(gradient, hessian, [this](std::size_t p, int lane, double* g, double* H) {
    const auto* pool = problem_.pools_[p].soft.get();
    return pool ? pool->accumulate(placement_[p], first_of_lane(*pool, lane), first_of_lane(*pool, lane + 1), g, H)
                : 0.0;
  });
}

void Program::constraints(Eigen::VectorXd& c) {
  take_point();
  double* out = c.data();
  for (const auto& p : problem_.pools_) {
    if (!p.hard) continue;
    p.hard->values(out);
    out += p.hard->size() * p.hard->dim();
  }
}

void Program::constraint_jacobian(Eigen::VectorXd& values) {
  chart_if_moved();
  for (std::size_t p = 0; p < problem_.pools_.size(); ++p)
    if (problem_.pools_[p].hard) problem_.pools_[p].hard->jacobian(placement_[p], nullptr, values.data());
}

void Program::linearize_constraints(Eigen::VectorXd& c, Eigen::VectorXd& jacobian) {
  chart_if_moved();
  double* out = c.data();
  for (std::size_t p = 0; p < problem_.pools_.size(); ++p)
    if (const auto* pool = problem_.pools_[p].hard.get()) {
      pool->jacobian(placement_[p], out, jacobian.data());
      out += pool->size() * pool->dim();
    }
}

void Program::add_constraint_hessian(const Eigen::VectorXd& weights, const Eigen::VectorXd& jacobian,
                                     Eigen::VectorXd& hessian) const {
  const double* w = weights.data();
  for (std::size_t p = 0; p < problem_.pools_.size(); ++p)
    if (const auto* pool = problem_.pools_[p].hard.get()) {
      pool->accumulate(placement_[p], w, jacobian.data(), hessian.data());
      w += pool->size() * pool->dim();
    }
}

void Program::multipliers(Eigen::VectorXd& y) const {
  double* out = y.data();
  for (const auto& p : problem_.pools_)
    if (p.hard) out = std::copy(p.hard->multipliers().begin(), p.hard->multipliers().end(), out);
}

void Program::set_multipliers(const Eigen::VectorXd& y) {
  const double* from = y.data();
  for (const auto& p : problem_.pools_)
    for (int i = 0; p.hard && i < p.hard->size(); ++i, from += p.hard->dim()) p.hard->set_multipliers(i, from);
}

Program::Stiffness Program::stiffness(const Eigen::VectorXd& v, const Eigen::VectorXd& row_weights) {
  chart_if_moved();
  Stiffness total{0, 0};
  const double* w = row_weights.data();
  for (std::size_t p = 0; p < problem_.pools_.size(); ++p) {
    const auto& pool = problem_.pools_[p];
    pool.base().add_stiffness(placement_[p], v.data(), w, total.along, total.scale);
    if (pool.hard) w += pool.hard->size() * pool.hard->dim();
  }
  return total;
}

void Program::exact_hessian(double factor, const Eigen::VectorXd& multipliers, Eigen::VectorXd& hessian) {
  chart_if_moved();
  sum_in_lanes(point_gradient_, &hessian, [&](std::size_t p, int lane, double* g, double* H) {
    const auto& pool = problem_.pools_[p];
    const double* lambda = pool.hard ? multipliers.data() + first_row_[p] : nullptr;
    pool.base().add_exact_hessian(placement_[p], first_of_lane(pool.base(), lane), first_of_lane(pool.base(), lane + 1),
                                  pool.hard ? 1.0 : factor, lambda, g, H);
    return 0.0;
  });
  for (const auto& [type, store] : problem_.stores_)
    store->add_chart_curvature(point_gradient_.data(), offset_, hessian_.column_start, hessian.data());
}

Program::Violation Program::violation(const Eigen::VectorXd& c) const {
  Violation worst{0.0, -1};
  for (int i = 0; i < num_rows(); ++i) {
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
  for (const auto& p : problem_.pools_) {
    if (!p.hard) continue;
    const int rows = p.hard->size() * p.hard->dim();
    if (row < rows) return problem_.describe(*p.hard, row / p.hard->dim());
    row -= rows;
  }
  return {};
}

std::string Program::describe_bad_block() {
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(num_unknowns());
  chart_if_moved();
  for (std::size_t p = 0; p < problem_.pools_.size(); ++p) {
    const auto* pool = problem_.pools_[p].soft.get();
    for (int i = 0; pool && i < pool->size(); ++i) {
      const double cost = pool->accumulate(placement_[p], i, i + 1, gradient.data(), nullptr);
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
