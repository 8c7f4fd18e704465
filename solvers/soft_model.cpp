#include <tandem/lie/error.hpp>
#include <tandem/problem/populate.hpp>
#include <tandem/solvers/damped_step.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/soft_model.hpp>

namespace tandem::detail {

SoftModel::SoftModel(Program& program, Session& session, const LevenbergMarquardtOptions& options,
                     bool with_constraints)
    : program_(program),
      session_(session),
      cholesky_(program.hessian_pattern()),
      secant_(program.num_unknowns(), options.secant_pairs, with_constraints) {
  cholesky_.use(program.lanes());
  for (Eigen::VectorXd* v : {&gradient_, &trial_gradient_, &last_gradient_, &scale_, &shift_, &diagonal_, &step_}) {
    v->resize(program.num_unknowns());
    populate(*v, std::size_t(v->size()));
    v->setZero();
  }
  hessian_.resize(program.hessian_pattern().nonzeros());
  populate(hessian_, std::size_t(hessian_.size()));
}

double SoftModel::linearize() {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  ++session_.summary.evaluations;
  hessian_is_here_ = false;
  const double cost = program_.linearize(gradient_, hessian_);
  hessian_is_here_ = true;
  find_scale();
  return cost;
}

void SoftModel::bring_hessian_here() {
  if (hessian_is_here_) return;
  const Session::Timer timer(session_.summary.evaluation_seconds);
  ++session_.summary.evaluations;
  program_.reset();
  program_.linearize(trial_gradient_, hessian_);
  hessian_is_here_ = true;
}

void SoftModel::find_scale() {
  hessian_diagonal(program_.hessian_pattern(), hessian_, scale_);
  all_curved_ = scale_.minCoeff() > 0;
}

std::string SoftModel::not_finite() {
  if (std::isfinite(gradient_.sum()) && std::isfinite(scale_.sum())) return {};
  program_.reset();
  return program_.describe_bad_block();
}

double SoftModel::scaled(const Eigen::VectorXd& gradient) const {
  double largest = 0;
  for (Eigen::Index i = 0; i < gradient.size(); ++i)
    if (scale_[i] > 0) largest = std::max(largest, std::abs(gradient[i]) / std::sqrt(scale_[i]));
  return largest;
}

bool SoftModel::factorize(const Eigen::VectorXd& hessian, double damping) {
  if (!all_curved_) hessian_diagonal(program_.hessian_pattern(), hessian, diagonal_);
  damping_shift(damping, scale_, all_curved_ ? scale_ : diagonal_, shift_);
  return cholesky_.factorize(hessian, shift_);
}

bool SoftModel::find_step(double damping) {
  bring_hessian_here();
  const Session::Timer timer(session_.summary.linear_solver_seconds);
  if (!factorize(hessian_, damping)) return false;
  step_ = -gradient_;
  secant_.apply(step_, [&](Eigen::VectorXd& d) { cholesky_.solve(d); });
  predicted_ = -0.5 * gradient_.dot(step_);  // (H + D) p = −g
  return true;
}

double SoftModel::merit_at_step(bool with_derivatives) {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  ++session_.summary.evaluations;
  trial_has_derivatives_ = with_derivatives;
  try {
    program_.move_to(step_);
    hessian_is_here_ = hessian_is_here_ && !with_derivatives;
    trial_cost_ = with_derivatives ? program_.linearize_at_point(trial_gradient_, hessian_) : program_.cost();
    return trial_cost_;
  } catch (const Error&) {
    return std::numeric_limits<double>::infinity();
  }
}

void SoftModel::move() {
  program_.recenter();
  session_.summary.cost = trial_cost_;
}

bool SoftModel::move_on() {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  const double cost_before = session_.summary.cost;
  move();
  try {
    hessian_is_here_ = false;
    if (!trial_has_derivatives_) program_.linearize(trial_gradient_, hessian_);
    linearize_constraints();
  } catch (const Error&) {
    last_gradient_ = -step_;
    program_.move_to(last_gradient_);
    program_.recenter();
    session_.summary.cost = cost_before;
    linearize_constraints();
    return false;
  }
  last_gradient_.swap(gradient_);
  gradient_.swap(trial_gradient_);
  hessian_is_here_ = true;
  find_scale();
  arrive();
  return true;
}

void SoftModel::learn() { secant_.add(step_, last_gradient_, gradient_); }

}  // namespace tandem::detail
