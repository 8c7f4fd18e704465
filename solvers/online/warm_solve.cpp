#include <cmath>
#include <limits>

#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/online/warm_solve.hpp>

namespace tandem::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRefusedDamping = 1e-6;  // the least after a step that was refused
constexpr double kFreeDamping = 1e-4;     // steps damped more than this are short for that reason
constexpr double kMaxDamping = 1e12;
constexpr double kModestGain = 0.1;           // of the cost
constexpr double kCovarianceDamping = 1e-10;  // more than this shows in the covariance

}  // namespace

WarmSolve::WarmSolve(Program& program, BlockCholesky& cholesky, const FixedLagOptions& options)
    : options_(options),
      program_(program),
      cholesky_(cholesky),
      session_("fixed-lag", options),
      damping_{options.initial_damping, options.initial_damping, kRefusedDamping, 10, 4},
      gradient_(program.num_unknowns()),
      hessian_(program.hessian_pattern().nonzeros()),
      scale_(program.num_unknowns()),
      shift_(program.num_unknowns()),
      step_(Eigen::VectorXd::Zero(program.num_unknowns())),
      trial_gradient_(program.num_unknowns()),
      trial_hessian_(hessian_.size()) {}

Summary WarmSolve::run() {
  auto& s = session_.summary;
  if (session_.start(program_, [this] { return linearize(); })) iterate();
  program_.reset();
  if (s.status != Status::failed && damped_) {  // the covariance is of the problem, not of a damped one, or of none
    linearize();
    damping_.value = options_.initial_damping;
    damped_ = !factorize();
  }
  return s;
}

double WarmSolve::linearize() {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  ++session_.summary.evaluations;
  const double cost = program_.linearize(gradient_, hessian_);
  hessian_diagonal(program_.hessian_pattern(), hessian_, scale_);
  return cost;
}

void WarmSolve::iterate() {
  auto& s = session_.summary;
  while (!session_.ended()) {
    if (!std::isfinite(gradient_.sum()) || !std::isfinite(scale_.sum())) {
      session_.end(Status::failed, "a Jacobian is not finite, in " + program_.describe_bad_block());
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

/// The step, by the least damping from damping_ on with which the Hessian is positive definite.
bool WarmSolve::find_step() {
  const Session::Timer timer(session_.summary.linear_solver_seconds);
  for (;; damping_.value = 100 * std::max(damping_.value, 1e-12)) {
    if (damping_.value > kMaxDamping) {
      session_.end(Status::failed, "no step lowers the cost, however short" + because(program_.doubt(step_)));
      return false;
    }
    if (factorize()) break;
  }
  damped_ = damping_.value > std::max(kCovarianceDamping, options_.initial_damping);
  step_ = -gradient_;
  cholesky_.solve(step_);
  predicted_ = 0.5 * (step_.cwiseAbs2().dot(shift_) - gradient_.dot(step_));
  return true;
}

bool WarmSolve::factorize() {
  for (Eigen::Index i = 0; i < shift_.size(); ++i)
    shift_[i] = scale_[i] > 0 ? damping_shift(damping_.value, scale_[i], scale_[i]) : kLeastInformation;
  return cholesky_.factorize(hessian_, shift_);
}

double WarmSolve::cost_at_step(With with) {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  ++session_.summary.evaluations;
  try {
    program_.move_to(step_);
    if (with == With::hessian) return program_.linearize_at_point(trial_gradient_, trial_hessian_);
    return with == With::gradient ? program_.gradient_at_point(trial_gradient_) : program_.cost();
  } catch (const Error&) {
    return kInfinity;  // undefined there: shorten the step
  }
}

void WarmSolve::try_step() {
  auto& s = session_.summary;
  const double least = options_.cost_tolerance * std::max(1.0, s.cost);
  const bool free_step = damping_.value <= std::max(kFreeDamping, options_.initial_damping);
  const bool last = free_step && predicted_ <= std::max(least, 1e-14 * s.cost);
  // Only a step of modest gain may be the last but for rounding; the others will need the Hessian after them.
  const bool perhaps_last = free_step && predicted_ <= kModestGain * std::max(1.0, s.cost);
  const With with = last ? With::nothing : perhaps_last ? With::gradient : With::hessian;
  const double trial = cost_at_step(with), drop = s.cost - trial;
  if (!(drop > 1e-4 * predicted_)) {
    if (last) {  // it had nothing to gain but rounding
      if (drop >= 0) accept(trial);
      return session_.end(Status::converged, "the cost changes no more");
    }
    program_.reset();
    damping_.refuse();
    return;
  }
  accept(trial);
  damping_.accept(drop / predicted_);
  if (last) {
    session_.end(Status::converged, "the cost changes no more");
  } else if (perhaps_last && left_to_gain() <= least) {
    session_.end(Status::converged, "another step has nothing left to gain");
  } else if (free_step && step_.cwiseAbs().maxCoeff() <= options_.step_tolerance) {
    session_.end(Status::converged, "the steps have become too small to matter");
  } else if (with == With::hessian) {
    gradient_.swap(trial_gradient_);
    hessian_.swap(trial_hessian_);
    hessian_diagonal(program_.hessian_pattern(), hessian_, scale_);
  } else if (s.iterations < options_.max_iterations) {
    linearize();
  }
}

void WarmSolve::accept(double cost) {
  program_.recenter();
  session_.summary.cost = cost;
}

/// By the gradient after the step and the curvature before it. That the cost fell as foretold would not do: it can by
/// coincidence, where the model is wrong both ways.
double WarmSolve::left_to_gain() {
  const Session::Timer timer(session_.summary.linear_solver_seconds);
  next_ = trial_gradient_;
  cholesky_.solve_lower(next_);  // gᵀ (L Lᵀ)⁻¹ g = ‖L⁻¹ g‖²
  return 0.5 * next_.squaredNorm();
}

}  // namespace tandem::detail
