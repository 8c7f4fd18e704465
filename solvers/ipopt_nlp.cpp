#include <algorithm>
#include <cmath>

#include <IpIpoptCalculatedQuantities.hpp>
#include <IpIpoptData.hpp>
#include <IpOrigIpoptNLP.hpp>
#include <IpTNLPAdapter.hpp>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/active_rows.hpp>
#include <tandem/solvers/ipopt_nlp.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>

namespace tandem::detail {
namespace {

constexpr double kRecenterAngle = 2.0;         // [rad]; the chart ends at π, and a restart loses Ipopt's history.
constexpr double kIpoptInfinity = 1e20;        // Exceeds Ipopt's nlp_upper_bound_inf.
constexpr double kSmallCostChange = 1e-2;      // Relative change of the cost per iteration.
constexpr int kMaxGaussNewtonIterations = 50;  // Iterations with Gauss-Newton; 10 to 30 are usual if it converges.
constexpr double kMinDamping = 1e-12;          // Smaller damping is below the rounding of a diagonal entry.
constexpr double kWhiteningDamping = 1e-10;    // Relative to the diagonal; whitening may be inexact.
constexpr double kWarmBarrier = 1e-6;    // Barrier for multipliers of an earlier solve, whose active bounds are close.
constexpr int kStagnantIterations = 15;  // Iterations without a significant decrease.
constexpr double kStagnantGradient = 1e-5;  // Gradient in white coordinates [standard deviations].
constexpr double kStagnantGain = 1e-12;     // Relative decrease of the cost in these iterations.
constexpr double kNegligibleSlope = 1e16;   // Stiffness of a row along a variable that it hardly reads.
constexpr double kMaxCostScale = 1e12;      // Limit of the cost scale.
constexpr double kMaxCostError = 1e-5;      // Maximum error of the cost by the barrier, relative to the cost.
constexpr double kNegligibleCost = 1e-3;    // Cost that counts as zero, relative to that expected at the initial guess.
constexpr double kMaxDamping = 1e3;         // Larger damping only shortens a gradient step, as the line search does.

}  // namespace

IpoptNlp::IpoptNlp(NlpEvaluator& nlp, Session& session, const IpoptOptions& options, double feasible)
    : feasible_(feasible),
      padding_(CondensedKkt::num_padding(nlp)),
      nlp_(nlp),
      session_(session),
      options_(options),
      exact_now_(options.hessian == Hessian::exact) {
  const int n = nlp.num_unknowns(), m = nlp.num_rows();
  const auto& h = nlp.hessian_pattern();
  const std::vector<int> start = h.column_starts(), rows = h.rows();
  lower_start_.push_back(0);
  for (int column = 0; column < n; ++column) {
    for (int k = start[std::size_t(column)]; k < start[std::size_t(column) + 1]; ++k)
      if (rows[std::size_t(k)] >= column) {
        if (rows[std::size_t(k)] == column) diagonal_.push_back(lower_triangle_.size());
        lower_triangle_.push_back({k, rows[std::size_t(k)]});
      }
    lower_start_.push_back(static_cast<int>(lower_triangle_.size()));
  }
  for (Eigen::VectorXd* v : {&x_, &current_, &best_, &gradient_, &unknowns_, &unit_}) v->setZero(n);
  iterate_.setZero(n + padding_);
  for (Eigen::VectorXd* v : {&multipliers_, &constraints_, &lambda_}) v->setZero(m);
  hessian_.setZero(h.nonzeros());
  if (options.hessian == Hessian::exact || options.hessian == Hessian::automatic) exact_ = hessian_;
  jacobian_.setZero(static_cast<Eigen::Index>(nlp.jacobian_pattern().row.size()));
  if (options.hessian == Hessian::limited_memory) white_.emplace(h);
}

void IpoptNlp::start() {
  recenter_ = false;
  has_cost_ = has_derivatives_ = has_constraints_ = false;  // cached values belong to the last chart
  x_.setZero();
  unknowns_.setZero();
  choose_unknowns();
  first_iteration_ = session_.summary.iterations;
  best_.setZero();
  best_point_ = {feasible_};
}

bool IpoptNlp::load_multipliers() {
  nlp_.multipliers(lambda_);
  barrier_ = kWarmBarrier;
  return !lambda_.isZero(0);
}

void IpoptNlp::store_multipliers() {
  Eigen::VectorXd y = lambda_ / cost_scale_;
  ActiveRows::drop_inactive(nlp_, y);
  nlp_.set_multipliers(y);
}

bool IpoptNlp::get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_hess, IndexStyleEnum& style) {
  n = nlp_.num_unknowns() + padding_;
  m = nlp_.num_rows();
  nnz_jac = static_cast<Index>(jacobian_.size());
  nnz_hess = static_cast<Index>(lower_triangle_.size()) + padding_;
  style = C_STYLE;
  return true;
}

bool IpoptNlp::get_bounds_info(Index n, Number* lower, Number* upper, Index m, Number* c_lower, Number* c_upper) {
  std::fill_n(lower, n, -kIpoptInfinity);
  std::fill_n(upper, n, kIpoptInfinity);
  for (Index i = 0; i < m; ++i) {
    c_lower[i] = std::max(nlp_.lower()[i], -kIpoptInfinity);
    c_upper[i] = std::min(nlp_.upper()[i], kIpoptInfinity);
  }
  return true;
}

/// Returns Σ ½ vᵢ² maxⱼ (Hⱼⱼ / Jᵢⱼ²): the cost at which each row alone could be met by its stiffest variable.
double IpoptNlp::cost_to_become_feasible() {
  Eigen::VectorXd curvature(nlp_.num_unknowns()), stiffness = Eigen::VectorXd::Zero(nlp_.num_rows());
  hessian_diagonal(nlp_.hessian_pattern(), hessian_, curvature);
  nlp_.linearize_constraints(constraints_, jacobian_);
  const TripletPattern& pattern = nlp_.jacobian_pattern();
  for (std::size_t k = 0; k < pattern.row.size(); ++k) {
    const double J = jacobian_[Index(k)], h = curvature[pattern.column[k]];
    if (h > kNegligibleSlope * J * J) continue;
    stiffness[pattern.row[k]] = std::max(stiffness[pattern.row[k]], h / (J * J));
  }
  double cost = 0;
  for (Index i = 0; i < constraints_.size(); ++i) {
    const double v = constraints_[i] - std::clamp(constraints_[i], nlp_.lower()[i], nlp_.upper()[i]);
    cost += 0.5 * v * v * stiffness[i];
  }
  return cost;
}

/// Sets the cost scale at the first initial guess. Without constraints there is no barrier.
void IpoptNlp::choose_cost_scale() {
  if (nlp_.num_rows() == 0 || expected_cost_ > 0) return;
  expected_cost_ = nlp_.cost() + cost_to_become_feasible();
  if (expected_cost_ > 0 && expected_cost_ < 1) set_cost_scale(1 / expected_cost_);
}

void IpoptNlp::set_cost_scale(double scale) {
  scale = std::min(scale, kMaxCostScale);
  lambda_ *= scale / cost_scale_;
  cost_scale_ = scale;
}

bool IpoptNlp::increase_cost_scale() {
  nlp_.constraints(constraints_);
  double error = 0;
  for (Index i = 0; i < constraints_.size(); ++i) {
    const double bound = lambda_[i] > 0 ? nlp_.upper()[i] : nlp_.lower()[i];
    if (std::isfinite(bound)) error += std::abs(lambda_[i] * (constraints_[i] - bound)) / cost_scale_;
  }
  const double cost = std::max(nlp_.cost(), kNegligibleCost * expected_cost_),
               scale = std::min(1 / cost, kMaxCostScale);
  if (!(error > kMaxCostError * cost) || !(scale > 2 * cost_scale_)) return false;
  barrier_ *= scale / cost_scale_;
  set_cost_scale(scale);
  return true;
}

/// Sets the scale of Ipopt's unknowns from the Hessian at X̄. Uses no scaling if the Hessian is undefined; Ipopt then
/// fails at its first gradient.
void IpoptNlp::choose_unknowns() try {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  unit_.setOnes();
  nlp_.reset();
  nlp_.linearize(gradient_, hessian_);
  hessian_diagonal(nlp_.hessian_pattern(), hessian_, unit_);
  if (white_ && !white_->factorize_shifted(hessian_, unit_, kWhiteningDamping)) {  // the Jacobians are too large
    white_.reset();
    unit_.setOnes();
    return;
  }
  choose_cost_scale();
  for (double& u : unit_) u = 1.0 / std::sqrt(cost_scale_ * (u > 0 ? u : 1.0));
} catch (const UndefinedResidualError&) {
  white_.reset();
  unit_.setOnes();
}

bool IpoptNlp::get_starting_point(Index n, bool init_x, Number* x, bool init_z, Number* z_lower, Number* z_upper,
                                  Index m, bool init_lambda, Number* lambda) {
  if (init_x) std::fill_n(x, n, 0.0);
  if (init_z) {  // δ has no bounds
    std::fill_n(z_lower, n, 0.0);
    std::fill_n(z_upper, n, 0.0);
  }
  if (init_lambda) std::copy_n(lambda_.data(), m, lambda);
  return true;
}

/// Calls f at x. An undefined residual is an evaluation error, for which Ipopt shortens the step. Other exceptions end
/// the solve.
template <class F>
bool IpoptNlp::evaluate(const Number* x, bool new_x, F f) {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  try {
    if (new_x || !std::equal(unknowns_.data(), unknowns_.data() + unknowns_.size(), x)) {
      has_cost_ = has_derivatives_ = has_constraints_ = false;
      x_ = unknowns_ = Eigen::Map<const Eigen::VectorXd>(x, x_.size());
      if (white_) {
        white_->solve_transposed(x_);
      } else {
        x_.array() *= unit_.array();
      }
      nlp_.move_to(x_);
    }
    f();
    return true;
  } catch (const UndefinedResidualError&) {
    return false;
  } catch (...) {
    error_ = std::current_exception();
    return false;
  }
}

void IpoptNlp::need_cost() {
  if (has_cost_) return;
  cost_ = nlp_.cost();
  ++session_.summary.evaluations;
  has_cost_ = true;
}

void IpoptNlp::need_derivatives() {
  if (has_derivatives_) return;
  if (options_.hessian == Hessian::limited_memory) {
    nlp_.gradient(gradient_);
  } else {
    nlp_.linearize(gradient_, hessian_);
  }
  has_derivatives_ = true;
}

void IpoptNlp::need_constraints() {
  if (has_constraints_) return;
  nlp_.constraints(constraints_);
  has_constraints_ = true;
}

/// Outside of Ipopt's restoration, the gradient has already been evaluated, together with the Gauss-Newton Hessian.
void IpoptNlp::need_exact(double factor) {
  if (factor != 1.0) return nlp_.exact_hessian(factor, multipliers_, exact_);
  need_derivatives();
  nlp_.curvature(multipliers_, exact_);
  exact_ += hessian_;
}

bool IpoptNlp::eval_f(Index, const Number* x, bool new_x, Number& value) {
  return evaluate(x, new_x, [&] {
    need_cost();
    value = cost_scale_ * cost_;
  });
}

bool IpoptNlp::eval_grad_f(Index n, const Number* x, bool new_x, Number* gradient) {
  return evaluate(x, new_x, [&] {
    need_derivatives();
    own_gradient_ = gradient_;
    if (white_) {
      white_->solve_lower(own_gradient_);
    } else {
      own_gradient_.array() *= unit_.array();
    }
    own_gradient_ *= cost_scale_;
    std::copy_n(own_gradient_.data(), own_gradient_.size(), gradient);
    std::fill_n(gradient + own_gradient_.size(), n - own_gradient_.size(), 0.0);
  });
}

bool IpoptNlp::eval_g(Index, const Number* x, bool new_x, Index m, Number* g) {
  return evaluate(x, new_x, [&] {
    need_constraints();
    std::copy_n(constraints_.data(), m, g);
  });
}

bool IpoptNlp::eval_jac_g(Index, const Number* x, bool new_x, Index, Index nnz, Index* row, Index* column,
                          Number* values) {
  if (!values) {
    std::copy_n(nlp_.jacobian_pattern().row.data(), nnz, row);
    std::copy_n(nlp_.jacobian_pattern().column.data(), nnz, column);
    return true;
  }
  return evaluate(x, new_x, [&] {
    nlp_.constraint_jacobian(jacobian_);
    const auto& columns = nlp_.jacobian_pattern().column;
    for (Index k = 0; k < nnz; ++k) values[k] = jacobian_[k] * unit_[columns[std::size_t(k)]];
  });
}

bool IpoptNlp::eval_h(Index, const Number* x, bool new_x, Number factor, Index m, const Number* lambda, bool, Index,
                      Index* row, Index* column, Number* values) {
  const auto& pattern = nlp_.hessian_pattern();
  if (!values) {
    for (int c = 0, k = 0; c < pattern.size(); ++c)
      for (; k < lower_start_[std::size_t(c) + 1]; ++k) {
        row[k] = lower_triangle_[std::size_t(k)].row;
        column[k] = c;
      }
    const auto first = lower_triangle_.size();
    for (int k = 0; k < padding_; ++k)
      row[first + std::size_t(k)] = column[first + std::size_t(k)] = pattern.size() + k;
    return true;
  }
  return evaluate(x, new_x, [&] {
    const Eigen::VectorXd* h = &hessian_;
    factor *= cost_scale_;
    std::fill_n(values + lower_triangle_.size(), padding_, 1.0);
    if (exact_now_) {
      multipliers_ = Eigen::Map<const Eigen::VectorXd>(lambda, m);
      need_exact(factor);
      factor = 1.0;
      h = &exact_;
    } else {
      need_derivatives();
    }
    for (int c = 0, k = 0; c < pattern.size(); ++c)
      for (const double unit = factor * unit_[c]; k < lower_start_[std::size_t(c) + 1]; ++k) {
        const auto [at, row_of] = lower_triangle_[std::size_t(k)];
        values[k] = unit * unit_[row_of] * (*h)[at];
      }
    if (!exact_now_)
      for (const std::size_t k : diagonal_) values[k] *= 1 + damping_;
  });
}

void IpoptNlp::finalize_solution(Ipopt::SolverReturn, Index, const Number* x, const Number*, const Number*, Index m,
                                 const Number*, const Number* lambda, Number, const Ipopt::IpoptData*,
                                 Ipopt::IpoptCalculatedQuantities*) {
  if (lambda) lambda_ = Eigen::Map<const Eigen::VectorXd>(lambda, m);
  if (!x) return;
  iterate_ = Eigen::Map<const Eigen::VectorXd>(x, iterate_.size());
  consider_best(iterate_);
}

void IpoptNlp::consider_best(const Eigen::VectorXd& iterate) {
  double cost = HUGE_VAL, violation = HUGE_VAL;
  const bool valid = evaluate(iterate.data(), false, [&] {
    need_cost();
    need_constraints();
    cost = cost_;
    violation = nlp_.violation(constraints_).size;
  });
  current_ = x_;
  if (valid && best_point_.offer(cost, violation)) best_ = x_;
}

/// Returns whether limited-memory steps have reached the level of rounding, where Ipopt's own criteria are met only by
/// chance.
bool IpoptNlp::stagnates(double cost, double gradient) {
  if (options_.hessian != Hessian::limited_memory) return false;
  if (cost < stagnant_cost_ * (1 - kStagnantGain)) {
    stagnant_cost_ = cost;
    stagnant_iterations_ = 0;
  }
  return ++stagnant_iterations_ >= kStagnantIterations && gradient <= kStagnantGradient;
}

bool IpoptNlp::intermediate_callback(Ipopt::AlgorithmMode, Index iteration, Number value, Number, Number gradient,
                                     Number mu, Number step, Number, Number, Number, Index trials,
                                     const Ipopt::IpoptData* data, Ipopt::IpoptCalculatedQuantities* quantities) {
  try {
    if (error_) return false;
    barrier_ = mu;
    // Ipopt has no trust region. If Gauss-Newton steps are shortened, damp them as Levenberg–Marquardt does.
    damping_ = trials > 1 ? std::min(kMaxDamping, std::max(damping_, kMinDamping) * std::pow(10.0, trials - 1))
                          : damping_ * 0.2;
    if (damping_ < kMinDamping) damping_ = 0;
    const bool cut_near_solution = trials > 1 && std::abs(value - last_cost_) <= kSmallCostChange * std::abs(value);
    if (options_.hessian == Hessian::automatic && (cut_near_solution || iteration > kMaxGaussNewtonIterations))
      exact_now_ = true;
    last_cost_ = value;
    session_.summary.iterations = first_iteration_ + iteration;
    // GetCurrIterate exists from Ipopt 3.14 on. The adapter knows the iterate in all versions, except in restoration.
    auto* orig = dynamic_cast<Ipopt::OrigIpoptNLP*>(Ipopt::GetRawPtr(quantities->GetIpoptNLP()));
    auto* adapter = orig ? dynamic_cast<Ipopt::TNLPAdapter*>(Ipopt::GetRawPtr(orig->nlp())) : nullptr;
    if (adapter && Ipopt::IsValid(data->curr())) {
      adapter->ResortX(*orig->NLP_scaling()->unapply_vector_scaling_x(data->curr()->x()), iterate_.data());
      consider_best(iterate_);
      recenter_ = nlp_.largest_angle() > kRecenterAngle;
    }
    session_.report_at(nlp_, current_, session_.summary.iterations, value / cost_scale_, step, best_point_.violation);
    if (options_.progress && current_ != x_) {  // in restoration: report_at() has moved the point
      x_ = current_;
      has_cost_ = has_derivatives_ = has_constraints_ = false;
    }
    if (stagnates(value, gradient)) session_.end(Status::converged, "the cost no longer changes");
    return !session_.ended() && !session_.should_stop() && !recenter_;
  } catch (...) {
    error_ = std::current_exception();
    return false;
  }
}

}  // namespace tandem::detail
