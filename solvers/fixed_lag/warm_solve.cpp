#include <cmath>
#include <limits>

#include <tandem/solvers/fixed_lag/warm_solve.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>

namespace tandem::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMaxDamping = 1e12;
constexpr double kModestGain = 0.1;  // relative to the cost

}  // namespace

WarmSolve::WarmSolve(NlpEvaluator& nlp, BlockCholesky& cholesky, const FixedLagOptions& options)
    : options_(options),
      nlp_(nlp),
      cholesky_(cholesky),
      session_("fixed-lag", options),
      damping_(options.initial_damping),
      gradient_(nlp.num_unknowns()),
      hessian_(nlp.hessian_pattern().nonzeros()),
      scale_(nlp.num_unknowns()),
      shift_(nlp.num_unknowns()),
      step_(Eigen::VectorXd::Zero(nlp.num_unknowns())),
      trial_gradient_(nlp.num_unknowns()),
      trial_hessian_(hessian_.size()) {}

Summary WarmSolve::run() {
  auto& s = session_.summary;
  if (session_.start(nlp_, [this] { return linearize(); })) iterate();
  nlp_.reset();
  if (s.status != Status::failed && damped_) {  // the covariance needs the factor of the undamped problem
    linearize();
    damping_.reset();
    damped_ = !factorize();
  }
  return s;
}

double WarmSolve::linearize() {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  ++session_.summary.evaluations;
  const double cost = nlp_.linearize(gradient_, hessian_);
  hessian_diagonal(nlp_.hessian_pattern(), hessian_, scale_);
  return cost;
}

void WarmSolve::iterate() {
  auto& s = session_.summary;
  while (!session_.ended()) {
    if (!std::isfinite(gradient_.sum()) || !std::isfinite(scale_.sum())) {
      session_.end(Status::failed, "a Jacobian is not finite, in " + nlp_.describe_nonfinite_block());
      return;
    }
    session_.report(s.iterations, s.cost, s.iterations ? step_.norm() : 0.0, 0.0);
    if (session_.should_stop()) return;
    if (s.iterations >= options_.max_iterations) {
      session_.end(Status::max_iterations);
      return;
    }
    ++s.iterations;
    if (!find_step()) return;
    try_step();
  }
}

/// Computes the step with the least damping, from damping_ on, for which the Hessian is positive definite.
bool WarmSolve::find_step() {
  const Session::Timer timer(session_.summary.linear_solver_seconds);
  for (;; damping_.increase()) {
    if (damping_.value > kMaxDamping) {
      session_.end(Status::failed,
                   "no step lowers the cost, not even a short one" + derivative_hint(nlp_.check_derivatives(step_)));
      return false;
    }
    if (factorize()) break;
  }
  damped_ = damping_.changes_covariance();
  step_ = -gradient_;
  cholesky_.solve(step_);
  predicted_ = 0.5 * (step_.cwiseAbs2().dot(shift_) - gradient_.dot(step_));
  return true;
}

bool WarmSolve::factorize() {
  damping_.set_shift(scale_, shift_);
  moved_ = false;
  return cholesky_.factorize(hessian_, shift_);
}

double WarmSolve::cost_at_step(With with) {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  ++session_.summary.evaluations;
  try {
    nlp_.move_to(step_);
    if (with == With::hessian) return nlp_.linearize_at_point(trial_gradient_, trial_hessian_);
    return with == With::gradient ? nlp_.gradient_at_point(trial_gradient_) : nlp_.cost();
  } catch (const UndefinedResidualError&) {
    return kInfinity;  // undefined: shorten the step
  }
}

void WarmSolve::try_step() {
  auto& s = session_.summary;
  const double min_gain = options_.cost_tolerance * std::max(1.0, s.cost);
  const bool undamped_step = damping_.is_undamped();
  const bool last = undamped_step && predicted_ <= std::max(min_gain, 1e-14 * s.cost);
  // Another step follows a step with a large predicted gain, so the Hessian is evaluated together with the cost. If the
  // step may be the last one, only the gradient is.
  const bool perhaps_last = undamped_step && predicted_ <= kModestGain * std::max(1.0, s.cost);
  const With with = last ? With::nothing : perhaps_last ? With::gradient : With::hessian;
  const double trial = cost_at_step(with), drop = s.cost - trial;
  if (!(drop > 1e-4 * predicted_)) {
    if (last) {  // only rounding was left to gain
      if (drop >= 0) accept(trial);
      return session_.end(Status::converged, "the cost no longer changes");
    }
    nlp_.reset();
    damping_.reject();
    return;
  }
  accept(trial);
  damping_.accept(drop / predicted_);
  if (last) {
    session_.end(Status::converged, "the cost no longer changes");
  } else if (perhaps_last && remaining_gain() <= min_gain) {
    session_.end(Status::converged, "the predicted gain of another step is below the tolerance");
  } else if (undamped_step && step_.cwiseAbs().maxCoeff() <= options_.step_tolerance) {
    session_.end(Status::converged, "the step is below its tolerance");
  } else if (with == With::hessian) {
    gradient_.swap(trial_gradient_);
    hessian_.swap(trial_hessian_);
    hessian_diagonal(nlp_.hessian_pattern(), hessian_, scale_);
  } else if (s.iterations < options_.max_iterations) {
    linearize();
  }
}

void WarmSolve::accept(double cost) {
  nlp_.recenter();
  moved_ = true;
  session_.summary.cost = cost;
}

/// Returns the predicted gain of another step, from the gradient after the step and the Hessian before it. The
/// agreement of actual and predicted decrease would not suffice, as it may be a coincidence.
double WarmSolve::remaining_gain() {
  const Session::Timer timer(session_.summary.linear_solver_seconds);
  next_ = trial_gradient_;
  cholesky_.solve_lower(next_);  // gᵀ (L Lᵀ)⁻¹ g = ‖L⁻¹ g‖²
  return 0.5 * next_.squaredNorm();
}

}  // namespace tandem::detail
