#include <algorithm>
#include <cmath>

#include <IpIpoptCalculatedQuantities.hpp>
#include <IpIpoptData.hpp>
#include <IpOrigIpoptNLP.hpp>
#include <IpTNLPAdapter.hpp>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/ipopt_nlp.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>

namespace tandem::detail {
namespace {

constexpr double kRecenterAngle = 2.0;   // rad: a restart costs Ipopt its history, and a chart ends only at π
constexpr double kIpoptInfinity = 1e20;  // beyond Ipopt's nlp_upper_bound_inf
constexpr double kNearSolution = 1e-2;   // relative change of the cost in an iteration
constexpr int kPatience = 50;  // iterations that Gauss-Newton alone is given; it needs 10 to 30 where it works
constexpr double kLeastDamping = 1e-12;    // less is lost against a diagonal that rounding has passed over
constexpr double kWhiteDamping = 1e-10;    // of the diagonal: what whitens need not be exact
constexpr double kWarmBarrier = 1e-6;      // with multipliers of an earlier solve, which belong to bounds close by
constexpr int kRestingIterations = 15;     // with hardly a gain
constexpr double kRestingGradient = 1e-5;  // in white coordinates: standard deviations
constexpr double kRestingGain = 1e-12;     // of the cost, in so many iterations
constexpr double kMostDamping = 1e3;       // more only shortens a gradient step, which Ipopt's line search does as well

}  // namespace

IpoptNlp::IpoptNlp(Program& program, Session& session, const IpoptOptions& options, double feasible)
    : feasible_(feasible),
      program_(program),
      session_(session),
      options_(options),
      exact_now_(options.hessian == Hessian::exact) {
  const int n = program.num_unknowns(), m = program.num_rows();
  const auto& h = program.hessian_pattern();
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
  for (Eigen::VectorXd* v : {&x_, &current_, &best_, &gradient_, &unknowns_, &iterate_, &unit_}) v->setZero(n);
  for (Eigen::VectorXd* v : {&multipliers_, &constraints_, &lambda_}) v->setZero(m);
  hessian_.setZero(h.nonzeros());
  if (options.hessian == Hessian::exact || options.hessian == Hessian::automatic) exact_ = hessian_;
  jacobian_.setZero(static_cast<Eigen::Index>(program.jacobian_pattern().row.size()));
  if (options.hessian == Hessian::limited_memory) white_.emplace(h);
}

void IpoptNlp::start() {
  recenter_ = false;
  has_cost_ = has_derivatives_ = has_constraints_ = false;  // of the last chart
  x_.setZero();
  unknowns_.setZero();
  choose_unknowns();
  first_iteration_ = session_.summary.iterations;
  best_.setZero();
  best_point_ = {feasible_};
}

bool IpoptNlp::take_multipliers() {
  program_.multipliers(lambda_);
  barrier_ = kWarmBarrier;
  return !lambda_.isZero(0);
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

/// What Ipopt's unknowns are, by the Hessian at X̄. Where that is undefined, so is Ipopt's first gradient.
void IpoptNlp::choose_unknowns() try {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  unit_.setOnes();
  program_.reset();
  program_.linearize(gradient_, hessian_);
  hessian_diagonal(program_.hessian_pattern(), hessian_, unit_);
  if (white_) {
    Eigen::VectorXd shift = unit_;
    for (double& d : shift) d = d > 0 ? kWhiteDamping * d : 1.0;
    while (!white_->factorize(hessian_, shift)) {
      shift *= 10;
      if (!shift.allFinite()) throw Error("the Jacobians are too large to be factorised");
    }
  }
  for (double& u : unit_) u = u > 0 ? 1.0 / std::sqrt(u) : 1.0;
} catch (const Error&) {
  white_.reset();
  unit_.setOnes();
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
    if (new_x || !std::equal(unknowns_.data(), unknowns_.data() + unknowns_.size(), x)) {
      has_cost_ = has_derivatives_ = has_constraints_ = false;
      x_ = unknowns_ = Eigen::Map<const Eigen::VectorXd>(x, x_.size());
      if (white_) {
        white_->solve_transposed(x_);
      } else {
        x_.array() *= unit_.array();
      }
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
  if (options_.hessian == Hessian::limited_memory) {
    program_.gradient(gradient_);
  } else {
    program_.linearize(gradient_, hessian_);
  }
  has_derivatives_ = true;
}

void IpoptNlp::need_constraints() {
  if (has_constraints_) return;
  program_.constraints(constraints_);
  has_constraints_ = true;
}

/// In the usual case, unlike Ipopt's restoration, the gradient has been asked for, and with it came Gauss-Newton's part.
void IpoptNlp::need_exact(double factor) {
  if (factor != 1.0) return program_.exact_hessian(factor, multipliers_, exact_);
  need_derivatives();
  program_.curvature(multipliers_, exact_);
  exact_ += hessian_;
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
    own_gradient_ = gradient_;
    if (white_) {
      white_->solve_lower(own_gradient_);
    } else {
      own_gradient_.array() *= unit_.array();
    }
    std::copy_n(own_gradient_.data(), n, gradient);
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
    const auto& columns = program_.jacobian_pattern().column;
    for (Index k = 0; k < nnz; ++k) values[k] = jacobian_[k] * unit_[columns[std::size_t(k)]];
  });
}

bool IpoptNlp::eval_h(Index, const Number* x, bool new_x, Number factor, Index m, const Number* lambda, bool, Index,
                      Index* row, Index* column, Number* values) {
  const auto& pattern = program_.hessian_pattern();
  if (!values) {
    for (int c = 0, k = 0; c < pattern.size(); ++c)
      for (; k < lower_start_[std::size_t(c) + 1]; ++k) {
        row[k] = lower_triangle_[std::size_t(k)].row;
        column[k] = c;
      }
    return true;
  }
  return evaluate(x, new_x, [&] {
    const Eigen::VectorXd* h = &hessian_;
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

void IpoptNlp::finalize_solution(Ipopt::SolverReturn, Index n, const Number* x, const Number*, const Number*, Index m,
                                 const Number*, const Number* lambda, Number, const Ipopt::IpoptData*,
                                 Ipopt::IpoptCalculatedQuantities*) {
  if (lambda) lambda_ = Eigen::Map<const Eigen::VectorXd>(lambda, m);
  if (!x) return;
  consider_best(Eigen::Map<const Eigen::VectorXd>(x, n));
}

void IpoptNlp::consider_best(const Eigen::VectorXd& iterate) {
  double cost = HUGE_VAL, violation = HUGE_VAL;
  const bool valid = evaluate(iterate.data(), false, [&] {
    need_cost();
    need_constraints();
    cost = cost_;
    violation = program_.violation(constraints_).size;
  });
  current_ = x_;
  if (valid && best_point_.offer(cost, violation)) best_ = x_;
}

/// Whether limited-memory steps have come to where rounding hides what is left to gain: Ipopt's own tolerances then are met by
/// chance, or never.
bool IpoptNlp::rests(double cost, double gradient) {
  if (options_.hessian != Hessian::limited_memory) return false;
  if (cost < resting_cost_ * (1 - kRestingGain)) {
    resting_cost_ = cost;
    resting_ = 0;
  }
  return ++resting_ >= kRestingIterations && gradient <= kRestingGradient;
}

bool IpoptNlp::intermediate_callback(Ipopt::AlgorithmMode, Index iteration, Number value, Number, Number gradient,
                                     Number mu, Number step, Number, Number, Number, Index trials,
                                     const Ipopt::IpoptData* data, Ipopt::IpoptCalculatedQuantities* quantities) {
  try {
    if (error_) return false;
    barrier_ = mu;
    // Ipopt has no trust region: where Gauss-Newton steps must be cut, damp them as Levenberg and Marquardt would.
    damping_ = trials > 1 ? std::min(kMostDamping, std::max(damping_, kLeastDamping) * std::pow(10.0, trials - 1))
                          : damping_ * 0.2;
    if (damping_ < kLeastDamping) damping_ = 0;
    const bool cut_near_solution = trials > 1 && std::abs(value - last_cost_) <= kNearSolution * std::abs(value);
    if (options_.hessian == Hessian::automatic && (cut_near_solution || iteration > kPatience)) exact_now_ = true;
    last_cost_ = value;
    session_.summary.iterations = first_iteration_ + iteration;
    // GetCurrIterate came with Ipopt 3.14; the adapter knows the iterate in all versions, but not in restoration.
    auto* nlp = dynamic_cast<Ipopt::OrigIpoptNLP*>(Ipopt::GetRawPtr(quantities->GetIpoptNLP()));
    auto* adapter = nlp ? dynamic_cast<Ipopt::TNLPAdapter*>(Ipopt::GetRawPtr(nlp->nlp())) : nullptr;
    if (adapter && Ipopt::IsValid(data->curr())) {
      adapter->ResortX(*nlp->NLP_scaling()->unapply_vector_scaling_x(data->curr()->x()), iterate_.data());
      consider_best(iterate_);
      recenter_ = program_.largest_angle() > kRecenterAngle;
    }
    session_.report_at(program_, current_, session_.summary.iterations, value, step, best_point_.violation);
    if (options_.progress && current_ != x_) {  // in restoration; the program's point is what was reported
      x_ = current_;
      has_cost_ = has_derivatives_ = has_constraints_ = false;
    }
    if (rests(value, gradient)) session_.end(Status::converged, "the cost changes no more");
    return !session_.ended() && !session_.should_stop() && !recenter_;
  } catch (...) {
    error_ = std::current_exception();
    return false;
  }
}

}  // namespace tandem::detail
