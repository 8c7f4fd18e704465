#include <algorithm>
#include <cmath>

#include <IpIpoptCalculatedQuantities.hpp>
#include <IpIpoptData.hpp>
#include <IpOrigIpoptNLP.hpp>
#include <IpTNLPAdapter.hpp>

#include <tandem/solvers/ipopt_nlp.hpp>

namespace tandem::detail {
namespace {

constexpr double kRecenterAngle = 2.0;   // rad: a restart costs Ipopt its history, and a chart ends only at π
constexpr double kIpoptInfinity = 1e20;  // beyond Ipopt's nlp_upper_bound_inf
constexpr double kNearSolution = 1e-2;   // relative change of the cost in an iteration
constexpr int kPatience = 50;  // iterations that Gauss-Newton alone is given; it needs 10 to 30 where it works
constexpr double kLeastDamping = 1e-12;  // less is lost against a diagonal that rounding has passed over
constexpr double kMostDamping = 1e3;     // more only shortens a gradient step, which Ipopt's line search does as well

}  // namespace

IpoptNlp::IpoptNlp(Program& program, Session& session, const IpoptOptions& options, double feasible)
    : feasible_(feasible),
      program_(program),
      session_(session),
      options_(options),
      exact_now_(options.hessian == Hessian::exact) {
  const int n = program.num_unknowns(), m = program.num_rows();
  const auto& h = program.hessian_pattern();
  for (int column = 0; column < n; ++column)
    for (int k = h.column_start[std::size_t(column)]; k < h.column_start[std::size_t(column) + 1]; ++k)
      if (h.row[std::size_t(k)] >= column) {
        if (h.row[std::size_t(k)] == column) diagonal_.push_back(lower_triangle_.size());
        lower_triangle_.push_back(k);
      }
  for (Eigen::VectorXd* v : {&x_, &current_, &best_, &gradient_}) v->setZero(n);
  for (Eigen::VectorXd* v : {&multipliers_, &constraints_, &lambda_}) v->setZero(m);
  hessian_.setZero(static_cast<Eigen::Index>(h.row.size()));
  if (options.hessian == Hessian::exact || options.hessian == Hessian::automatic) exact_ = hessian_;
  jacobian_.setZero(static_cast<Eigen::Index>(program.jacobian_pattern().row.size()));
}

void IpoptNlp::start() {
  recenter_ = false;
  has_cost_ = has_derivatives_ = has_constraints_ = false;  // of the last chart
  x_.setZero();
  first_iteration_ = session_.summary.iterations;
  best_.setZero();
  best_point_ = {feasible_};
}

bool IpoptNlp::get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_hess, IndexStyleEnum& style) {
  n = program_.num_unknowns();
  m = program_.num_rows();
  nnz_jac = static_cast<Index>(jacobian_.size());
  nnz_hess = static_cast<Index>(lower_triangle_.size());
  style = C_STYLE;
  return true;
}

bool IpoptNlp::get_bounds_info(Index n, Number* lower, Number* upper, Index m, Number* c_lower, Number* c_upper) {
  std::fill_n(lower, n, -kIpoptInfinity);
  std::fill_n(upper, n, kIpoptInfinity);
  for (Index i = 0; i < m; ++i) {
    c_lower[i] = std::max(program_.lower()[i], -kIpoptInfinity);
    c_upper[i] = std::min(program_.upper()[i], kIpoptInfinity);
  }
  return true;
}

/// Unknowns in units of unit curvature: stiff and slack directions then meet Ipopt's tolerance and its regularisation
/// alike.
bool IpoptNlp::get_scaling_parameters(Number& cost_scale, bool& use_x, Index n, Number* x_scale, bool& use_g, Index,
                                      Number*) {
  cost_scale = 1.0;
  use_g = false;
  use_x = evaluate(x_.data(), true, [&] {
    program_.linearize(gradient_, hessian_);
    for (Index i = 0; i < n; ++i) {
      const double curvature = hessian_[lower_triangle_[diagonal_[std::size_t(i)]]];
      x_scale[i] = curvature > 0 ? std::sqrt(curvature) : 1.0;
    }
  });
  return true;
}

bool IpoptNlp::get_starting_point(Index n, bool init_x, Number* x, bool init_z, Number* z_lower, Number* z_upper,
                                  Index m, bool init_lambda, Number* lambda) {
  if (init_x) std::fill_n(x, n, 0.0);
  if (init_z) {  // no bounds on δ
    std::fill_n(z_lower, n, 0.0);
    std::fill_n(z_upper, n, 0.0);
  }
  if (init_lambda) std::copy_n(lambda_.data(), m, lambda);
  return true;
}

/// Runs f at x. An undefined residual is an evaluation error, on which Ipopt shortens the step; anything else ends it.
template <class F>
bool IpoptNlp::evaluate(const Number* x, bool new_x, F f) {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  try {
    if (new_x || !std::equal(x_.data(), x_.data() + x_.size(), x)) {
      has_cost_ = has_derivatives_ = has_constraints_ = false;
      x_ = Eigen::Map<const Eigen::VectorXd>(x, x_.size());
      program_.move_to(x_);
    }
    f();
    return true;
  } catch (const Error&) {
    return false;
  } catch (...) {
    error_ = std::current_exception();
    return false;
  }
}

void IpoptNlp::need_cost() {
  if (has_cost_) return;
  cost_ = program_.cost();
  ++session_.summary.evaluations;
  has_cost_ = true;
}

void IpoptNlp::need_derivatives() {
  if (has_derivatives_) return;
  if (!exact_now_ && options_.hessian != Hessian::limited_memory) {
    program_.linearize(gradient_, hessian_);
  } else {
    program_.gradient(gradient_);
  }
  has_derivatives_ = true;
}

void IpoptNlp::need_constraints() {
  if (has_constraints_) return;
  program_.constraints(constraints_);
  has_constraints_ = true;
}

bool IpoptNlp::eval_f(Index, const Number* x, bool new_x, Number& value) {
  return evaluate(x, new_x, [&] {
    need_cost();
    value = cost_;
  });
}

bool IpoptNlp::eval_grad_f(Index n, const Number* x, bool new_x, Number* gradient) {
  return evaluate(x, new_x, [&] {
    need_derivatives();
    std::copy_n(gradient_.data(), n, gradient);
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
    std::copy_n(program_.jacobian_pattern().row.data(), nnz, row);
    std::copy_n(program_.jacobian_pattern().column.data(), nnz, column);
    return true;
  }
  return evaluate(x, new_x, [&] {
    program_.constraint_jacobian(jacobian_);
    std::copy_n(jacobian_.data(), nnz, values);
  });
}

bool IpoptNlp::eval_h(Index, const Number* x, bool new_x, Number factor, Index m, const Number* lambda, bool, Index,
                      Index* row, Index* column, Number* values) {
  const auto& pattern = program_.hessian_pattern();
  if (!values) {
    std::size_t next = 0;
    for (int c = 0; c < pattern.size(); ++c)
      for (int k = pattern.column_start[std::size_t(c)]; k < pattern.column_start[std::size_t(c) + 1]; ++k)
        if (pattern.row[std::size_t(k)] >= c) {
          row[next] = pattern.row[std::size_t(k)];
          column[next++] = c;
        }
    return true;
  }
  return evaluate(x, new_x, [&] {
    const Eigen::VectorXd* h = &hessian_;
    if (exact_now_) {
      multipliers_ = Eigen::Map<const Eigen::VectorXd>(lambda, m);
      program_.exact_hessian(factor, multipliers_, exact_);
      factor = 1.0;
      h = &exact_;
    } else {
      need_derivatives();
    }
    for (std::size_t k = 0; k < lower_triangle_.size(); ++k) values[k] = factor * (*h)[lower_triangle_[k]];
    if (!exact_now_)
      for (const std::size_t k : diagonal_) values[k] *= 1 + damping_;
  });
}

void IpoptNlp::finalize_solution(Ipopt::SolverReturn, Index n, const Number* x, const Number*, const Number*, Index m,
                                 const Number*, const Number* lambda, Number, const Ipopt::IpoptData*,
                                 Ipopt::IpoptCalculatedQuantities*) {
  if (lambda) lambda_ = Eigen::Map<const Eigen::VectorXd>(lambda, m);
  if (!x) return;
  current_ = Eigen::Map<const Eigen::VectorXd>(x, n);
  consider_best(current_);
}

void IpoptNlp::consider_best(const Eigen::VectorXd& x) {
  double cost = HUGE_VAL, violation = HUGE_VAL;
  const bool valid = evaluate(x.data(), false, [&] {
    need_cost();
    need_constraints();
    cost = cost_;
    violation = program_.violation(constraints_).size;
  });
  if (!valid) return;
  if (best_point_.offer(cost, violation)) best_ = x;
}

bool IpoptNlp::intermediate_callback(Ipopt::AlgorithmMode, Index iteration, Number value, Number, Number, Number mu,
                                     Number step, Number, Number, Number, Index trials, const Ipopt::IpoptData* data,
                                     Ipopt::IpoptCalculatedQuantities* quantities) {
  try {
    if (error_) return false;
    barrier_ = mu;
    // Ipopt has no trust region: where Gauss-Newton steps must be cut, damp them as Levenberg and Marquardt would.
    damping_ = trials > 1 ? std::min(kMostDamping, std::max(damping_, kLeastDamping) * std::pow(10.0, trials - 1))
                          : damping_ * 0.2;
    if (damping_ < kLeastDamping) damping_ = 0;
    const bool cut_near_solution = trials > 1 && std::abs(value - last_cost_) <= kNearSolution * std::abs(value);
    if (options_.hessian == Hessian::automatic && !exact_now_ && (cut_near_solution || iteration > kPatience)) {
      exact_now_ = true;
      has_derivatives_ = false;
    }
    last_cost_ = value;
    session_.summary.iterations = first_iteration_ + iteration;
    // GetCurrIterate came with Ipopt 3.14; the adapter knows the iterate in all versions, but not in restoration.
    auto* nlp = dynamic_cast<Ipopt::OrigIpoptNLP*>(Ipopt::GetRawPtr(quantities->GetIpoptNLP()));
    auto* adapter = nlp ? dynamic_cast<Ipopt::TNLPAdapter*>(Ipopt::GetRawPtr(nlp->nlp())) : nullptr;
    if (adapter && Ipopt::IsValid(data->curr())) {
      adapter->ResortX(*nlp->NLP_scaling()->unapply_vector_scaling_x(data->curr()->x()), current_.data());
      consider_best(current_);
      recenter_ = program_.largest_angle() > kRecenterAngle;
    }
    session_.report_at(program_, current_, session_.summary.iterations, value, step, best_point_.violation);
    if (options_.progress && current_ != x_) {  // in restoration; the program's point is what was reported
      x_ = current_;
      has_cost_ = has_derivatives_ = has_constraints_ = false;
    }
    return !session_.should_stop() && !recenter_;
  } catch (...) {
    error_ = std::current_exception();
    return false;
  }
}

}  // namespace tandem::detail
