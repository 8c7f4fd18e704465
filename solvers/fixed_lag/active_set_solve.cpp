#include <algorithm>
#include <cmath>

#include <tandem/solvers/fixed_lag/active_set_solve.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>

namespace tandem::detail {
namespace {

constexpr int kIterations = 10;        // limit while the constraints do not hold, relative to max_iterations
constexpr int kMaxActiveSets = 40;     // maximum number of active sets per step
constexpr int kManyActiveSets = 6;     // number of active sets after which one row at a time changes
constexpr double kWrongSign = 1e-9;    // of a multiplier [standard deviations]
constexpr double kMeritNoise = 1e-10;  // relative change of the merit function that may be rounding
constexpr double kExcessiveDamping = 1e6;
constexpr double kNearlyFeasible = 1e4;  // violation after a step that one correction removes, in tolerances

}  // namespace

ActiveSetSolve::ActiveSetSolve(NlpEvaluator& nlp, BlockCholesky& cholesky, ActiveRows& rows,
                               const FixedLagOptions& options)
    : options_(options),
      nlp_(nlp),
      cholesky_(cholesky),
      rows_(rows),
      session_("fixed-lag", options),
      damping_(options.initial_damping) {
  for (Eigen::VectorXd* v : {&gradient_, &scale_, &shift_, &step_, &trial_gradient_}) v->setZero(nlp.num_unknowns());
  for (Eigen::VectorXd* v : {&hessian_, &augmented_}) v->resize(nlp.hessian_pattern().nonzeros());
  for (Eigen::VectorXd* v : {&c_, &trial_c_, &y_, &b_, &of_step_, &penalty_}) v->setZero(nlp.num_rows());
  for (Eigen::VectorXd* v : {&jacobian_, &trial_jacobian_}) v->resize(Eigen::Index(nlp.jacobian_pattern().row.size()));
}

Summary ActiveSetSolve::run() {
  auto& s = session_.summary;
  nlp_.multipliers(y_);
  sides_ = ActiveRows::sides(nlp_, y_);
  if (session_.start(nlp_, [this] { return linearize(); })) {
    tolerances_ = row_tolerances(nlp_, jacobian_, kConstraintTolerance);
    iterate();
  }
  nlp_.reset();
  if (s.status == Status::failed || s.status == Status::infeasible || gave_up_) return s;
  if (damped_) {  // the covariance needs the factor of the undamped problem
    linearize();
    damping_.reset();
    factorize();
  }
  s.max_violation = nlp_.violation(c_).size;
  const NlpEvaluator::Violation worst = violation(c_);
  if (worst.size > 1) s.worst_constraint = nlp_.describe_row(worst.row);
  nlp_.set_multipliers(y_);
  return s;
}

double ActiveSetSolve::linearize() {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  ++session_.summary.evaluations;
  const double cost = nlp_.linearize(gradient_, hessian_);
  hessian_diagonal(nlp_.hessian_pattern(), hessian_, scale_);
  nlp_.linearize_constraints(c_, jacobian_);
  return cost;
}

bool ActiveSetSolve::give_up() {
  gave_up_ = true;
  session_.end(Status::max_iterations);
  return false;
}

void ActiveSetSolve::iterate() {
  auto& s = session_.summary;
  while (!session_.ended()) {
    if (!std::isfinite(gradient_.sum()) || !std::isfinite(scale_.sum()) || !std::isfinite(jacobian_.sum())) {
      give_up();  // the next solver names the block
      return;
    }
    session_.report(s.iterations, s.cost, s.iterations ? step_.norm() : 0.0, nlp_.violation(c_).size);
    if (session_.should_stop()) return;
    if (s.iterations >= options_.max_iterations && violation(c_).size <= 1) {
      session_.end(Status::max_iterations);
      return;
    }
    if (s.iterations >= kIterations * options_.max_iterations || damping_.value > kExcessiveDamping) {
      give_up();
      return;
    }
    ++s.iterations;
    if (!find_step()) return;
    if (!try_step()) {
      damping_.reject();
    } else if (!session_.ended()) {
      linearize();
    }
  }
}

/// Minimises the model. On the way, finds its active set.
bool ActiveSetSolve::find_step() {
  const Session::Timer timer(session_.summary.linear_solver_seconds);
  bounds_minus(c_, b_);
  for (int set = 0; set < kMaxActiveSets; ++set) {
    if (!factorize() || !rows_.solve(cholesky_, gradient_, b_, step_, y_)) return give_up();
    if (change_active_set(set < kManyActiveSets)) continue;
    // The cost falls by −gᵀp − ½ pᵀHp with (H + λD) p = −g − Aᵀ y, and the violation vanishes.
    penalty_ = 2 * y_.cwiseAbs();
    predicted_ = 0.5 * (step_.cwiseAbs2().dot(shift_) - gradient_.dot(step_) + y_.dot(b_)) + penalised_violation(c_);
    return true;
  }
  return give_up();
}

/// Factorizes with the least damping, from damping_ on, for which the matrix is positive definite.
bool ActiveSetSolve::factorize() {
  rows_ = ActiveRows(nlp_, jacobian_, sides_, scale_);
  augmented_ = hessian_;
  nlp_.add_constraint_hessian(rows_.weights(), jacobian_, augmented_);
  for (; damping_.value <= kExcessiveDamping; damping_.increase()) {
    damping_.set_shift(scale_, shift_);
    if (!cholesky_.factorize(augmented_, shift_)) continue;
    damped_ = damping_.changes_covariance();
    return true;
  }
  damped_ = true;
  return false;
}

/// Updates the active set for the step: all rows that must change, or the worst of them. Returns whether one changed.
bool ActiveSetSolve::change_active_set(bool all) {
  const TripletPattern& pattern = nlp_.jacobian_pattern();
  of_step_ = c_;
  for (std::size_t k = 0; k < pattern.row.size(); ++k)
    of_step_[pattern.row[k]] += jacobian_[Eigen::Index(k)] * step_[pattern.column[k]];
  bool changed = false;
  double worst = 0;
  Eigen::Index worst_row = -1;
  ActiveRows::Side worst_side{};
  for (Eigen::Index i = 0; i < c_.size(); ++i) {
    const double low = nlp_.lower()[i], high = nlp_.upper()[i];
    ActiveRows::Side& side = sides_[std::size_t(i)];
    if (low == high) continue;
    ActiveRows::Side next = side;
    double by = 0;
    if (side != ActiveRows::inactive && int(side) * y_[i] < 0) {
      by = std::abs(y_[i]) / rows_.root_stiffness(i);
      if (by > kWrongSign) next = ActiveRows::inactive;
      if (by <= kWrongSign) y_[i] = 0;
    } else if (side == ActiveRows::inactive) {
      const double above = of_step_[i] - high, below = low - of_step_[i];
      if (std::max(above, below) > 0.1 * tolerances_[i]) next = above > below ? ActiveRows::upper : ActiveRows::lower;
      by = std::max(above, below) * rows_.root_stiffness(i);
    }
    if (next == side) continue;
    changed = true;
    if (all) {
      side = next;
      if (next == ActiveRows::inactive) y_[i] = 0;
    } else if (by > worst) {
      worst = by;
      worst_row = i;
      worst_side = next;
    }
  }
  if (worst_row >= 0) {
    sides_[std::size_t(worst_row)] = worst_side;
    if (worst_side == ActiveRows::inactive) y_[worst_row] = 0;
  }
  if (changed) bounds_minus(c_, b_);
  return changed;
}

/// b = bound − c of the active rows, 0 for the others.
void ActiveSetSolve::bounds_minus(const Eigen::VectorXd& c, Eigen::VectorXd& b) const {
  for (Eigen::Index i = 0; i < b.size(); ++i) {
    const ActiveRows::Side side = sides_[std::size_t(i)];
    b[i] = side == ActiveRows::inactive ? 0 : (side == ActiveRows::upper ? nlp_.upper() : nlp_.lower())[i] - c[i];
  }
}

double ActiveSetSolve::penalised_violation(const Eigen::VectorXd& c) const {
  double sum = 0;
  for (Eigen::Index i = 0; i < c.size(); ++i)
    sum += penalty_[i] * std::max({0.0, c[i] - nlp_.upper()[i], nlp_.lower()[i] - c[i]});
  return sum;
}

/// Evaluates the cost, its gradient and the rows at the step, and returns the merit function.
double ActiveSetSolve::merit_at_step() {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  ++session_.summary.evaluations;
  try {
    nlp_.move_to(step_);
    trial_cost_ = nlp_.gradient_at_point(trial_gradient_);
    nlp_.linearize_constraints_at_point(trial_c_, trial_jacobian_);
    return trial_cost_ + penalised_violation(trial_c_);
  } catch (const UndefinedResidualError&) {
    return HUGE_VAL;
  }
}

/// Second-order correction: moves the step so that the curved rows hold (Nocedal & Wright 2006, §18.3).
void ActiveSetSolve::correct_step() {
  const Session::Timer timer(session_.summary.linear_solver_seconds);
  bounds_minus(trial_c_, b_);
  for (Eigen::Index i = 0; i < b_.size(); ++i)
    if (sides_[std::size_t(i)] != ActiveRows::inactive) b_[i] += of_step_[i] - c_[i];
  rows_.solve(cholesky_, gradient_, b_, step_, y_);
}

/// Tries the step. Corrects it if it fails, or if only the curvature of the rows keeps it from being the last one.
/// Returns false if X̄ does not move.
bool ActiveSetSolve::try_step() {
  auto& s = session_.summary;
  const double min_gain = options_.cost_tolerance * std::max(1.0, s.cost);
  const double before = s.cost + penalised_violation(c_), rounding = kMeritNoise * std::max(1.0, s.cost);
  const bool undamped = damping_.is_undamped();
  const auto is_accepted = [&](double merit) {
    return std::isfinite(merit) && before - merit >= std::min(1e-4 * predicted_, -rounding + predicted_);
  };
  double merit = merit_at_step();
  const bool accepted = is_accepted(merit);
  const double left = accepted ? violation(trial_c_).size : 0;
  if (!accepted || (left > 1 && left <= kNearlyFeasible)) {
    const Eigen::VectorXd full = step_, multipliers = y_;
    nlp_.reset();
    correct_step();
    merit = merit_at_step();
    if (!is_accepted(merit)) {
      step_ = full;
      y_ = multipliers;
      nlp_.reset();
      if (accepted) merit = merit_at_step();
    }
  }
  if (!accepted && !is_accepted(merit)) {
    if (undamped && predicted_ <= min_gain && violation(c_).size <= 1)
      session_.end(Status::converged, "the cost no longer changes");
    return false;
  }
  nlp_.recenter();
  damping_.accept(std::max(0.0, before - merit) / predicted_);  // negative by rounding only
  s.cost = trial_cost_;
  c_.swap(trial_c_);
  jacobian_.swap(trial_jacobian_);
  if (!undamped || violation(c_).size > 1) return true;
  if (remaining_gain() <= min_gain) {
    session_.end(Status::converged, "the predicted gain of another step is below the tolerance");
  } else if (step_.cwiseAbs().maxCoeff() <= options_.step_tolerance) {
    session_.end(Status::converged, "the step is below its tolerance");
  }
  return true;
}

/// Returns the predicted gain of another step, from the gradient of the Lagrangian after the step and the Hessian
/// before it.
double ActiveSetSolve::remaining_gain() {
  const Session::Timer timer(session_.summary.linear_solver_seconds);
  const TripletPattern& pattern = nlp_.jacobian_pattern();
  for (std::size_t k = 0; k < pattern.row.size(); ++k)
    trial_gradient_[pattern.column[k]] += jacobian_[Eigen::Index(k)] * y_[pattern.row[k]];
  cholesky_.solve_lower(trial_gradient_);
  return 0.5 * trial_gradient_.squaredNorm();
}

}  // namespace tandem::detail
