#include <algorithm>
#include <cmath>

#include <tandem/solvers/fixed_lag/active_set_solve.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/linear/jacobian_products.hpp>

namespace tandem::detail {
namespace {

constexpr int kIterations = 10;        // limit while the constraints do not hold, relative to max_iterations
constexpr int kMaxActiveSets = 40;     // maximum number of active sets per step
constexpr int kManyActiveSets = 6;     // number of active sets after which one row at a time changes
constexpr double kWrongSign = 1e-9;    // of a multiplier [standard deviations]
constexpr double kMeritNoise = 1e-10;  // relative change of the merit function that may be rounding
constexpr double kExcessiveDamping = 1e6;
constexpr double kSmallRowErrors = 1e-4;       // of one solve [standard deviations]
constexpr double kNegligibleViolation = 0.01;  // in tolerances
constexpr int kMaxCorrections = 6;             // of a step; two or three are usual
constexpr double kSlowDecrease = 0.1;          // of the error of the rows by a correction

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
  const auto begin = [this] {
    nlp_.linearize_constraints(c_, jacobian_);
    tolerances_ = row_tolerances(nlp_, jacobian_, kConstraintTolerance);
    return linearize();
  };
  if (session_.start(nlp_, begin)) iterate();
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
  drop_wrong_signs();  // corrections leave rounding errors
  nlp_.set_multipliers(y_);
  return s;
}

/// Evaluates the derivatives of the cost. The last step has evaluated the rows at X̄.
double ActiveSetSolve::linearize() {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  ++session_.summary.evaluations;
  const double cost = nlp_.linearize(gradient_, hessian_);
  hessian_diagonal(nlp_.hessian_pattern(), hessian_, scale_);
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
  for (int set = 0; set < kMaxActiveSets; ++set) {
    bounds_minus(c_, b_);
    if (!factorize()) return give_up();
    // One solve is enough if its errors are small and do not decide on the active set: correct_step() removes them.
    const double error = rows_.solve(cholesky_, gradient_, b_, step_, y_, errors_);
    bool changes = must_change_active_set();
    if (!(error <= kSmallRowErrors) || (changes && !rows_.empty())) {
      if (!rows_.refine(cholesky_, b_, step_, y_, errors_)) return give_up();
      changes = must_change_active_set();
    }
    if (changes) {
      change_active_set(set < kManyActiveSets);
      continue;
    }
    drop_wrong_signs();
    // The cost falls by −gᵀp − ½ pᵀHp with (H + λD) p = −g − Aᵀ y, and the violation vanishes.
    penalty_ = 2 * y_.cwiseAbs();
    predicted_ = 0.5 * (step_.cwiseAbs2().dot(shift_) - gradient_.dot(step_) + y_.dot(b_)) + penalised_violation(c_);
    return true;
  }
  return give_up();
}

/// Factorizes with the least damping, from damping_ on, for which the matrix is positive definite.
bool ActiveSetSolve::factorize() {
  rows_.set(nlp_, jacobian_, sides_, scale_);
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

/// Returns the side of a row that the model's minimum asks for.
ActiveSetSolve::Change ActiveSetSolve::change_of(Eigen::Index row) const {
  const double low = nlp_.lower()[row], high = nlp_.upper()[row];
  const ActiveRows::Side side = sides_[std::size_t(row)];
  if (low == high) return {side, 0};
  if (side == ActiveRows::inactive) {
    const double above = of_step_[row] - high, below = low - of_step_[row];
    if (std::max(above, below) <= 0.1 * tolerances_[row]) return {side, 0};
    return {above > below ? ActiveRows::upper : ActiveRows::lower, std::max(above, below) * rows_.root_stiffness(row)};
  }
  if (int(side) * y_[row] >= 0) return {side, 0};
  const double by = std::abs(y_[row]) / rows_.root_stiffness(row);
  return {by > kWrongSign ? ActiveRows::inactive : side, by};
}

bool ActiveSetSolve::must_change_active_set() {
  of_step_ = c_;
  add_jacobian_product(nlp_.jacobian_pattern(), jacobian_, step_, of_step_);
  for (Eigen::Index i = 0; i < c_.size(); ++i)
    if (change_of(i).side != sides_[std::size_t(i)]) return true;
  return false;
}

/// Updates the active set for the step: all rows that must change, or the worst of them.
void ActiveSetSolve::change_active_set(bool all) {
  const auto change = [&](Eigen::Index row, ActiveRows::Side side) {
    sides_[std::size_t(row)] = side;
    if (side == ActiveRows::inactive) y_[row] = 0;
  };
  Change worst{ActiveRows::inactive, 0};
  Eigen::Index worst_row = -1;
  for (Eigen::Index i = 0; i < c_.size(); ++i) {
    const Change next = change_of(i);
    if (next.side == sides_[std::size_t(i)]) continue;
    if (all) {
      change(i, next.side);
    } else if (next.by > worst.by) {
      worst = next;
      worst_row = i;
    }
  }
  if (worst_row >= 0) change(worst_row, worst.side);
}

/// Sets multipliers of the wrong sign, which are negligible once the active set is found, to zero.
void ActiveSetSolve::drop_wrong_signs() {
  for (Eigen::Index i = 0; i < y_.size(); ++i)
    if (nlp_.lower()[i] != nlp_.upper()[i] && int(sides_[std::size_t(i)]) * y_[i] < 0) y_[i] = 0;
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

/// Second-order corrections: move the step until the curved active rows hold (Nocedal & Wright 2006, §18.3), or as long
/// as their error falls fast. Each one takes a solve with the factor at hand. Returns whether the step has changed.
bool ActiveSetSolve::correct_step() {
  const Session::Timer timer(session_.summary.linear_solver_seconds);
  Eigen::VectorXd last_step = step_, last_y = y_;
  double before = HUGE_VAL;
  for (int i = 0;; ++i) {
    double error = HUGE_VAL;
    try {
      nlp_.move_to(step_);
      nlp_.constraints(trial_c_);
      bounds_minus(trial_c_, errors_);
      errors_ = -errors_;
      error = errors_.cwiseQuotient(tolerances_).cwiseAbs().maxCoeff();
    } catch (const UndefinedResidualError&) {
    }
    if (!(error < before)) {
      step_ = last_step;
      y_ = last_y;
      return i > 1;
    }
    if (error <= kNegligibleViolation || error > kSlowDecrease * before || i == kMaxCorrections) return i > 0;
    before = error;
    last_step = step_;
    last_y = y_;
    rows_.correct(cholesky_, step_, y_, errors_);
  }
}

/// Tries the step for which the active rows hold, then that of the model. Returns false if X̄ does not move.
bool ActiveSetSolve::try_step() {
  auto& s = session_.summary;
  const double min_gain = options_.cost_tolerance * std::max(1.0, s.cost);
  const double before = s.cost + penalised_violation(c_), rounding = kMeritNoise * std::max(1.0, s.cost);
  const bool undamped = damping_.is_undamped();
  const auto is_accepted = [&](double merit) {
    return std::isfinite(merit) && before - merit >= std::min(1e-4 * predicted_, -rounding + predicted_);
  };
  const Eigen::VectorXd full = step_, multipliers = y_;
  const bool corrected = !rows_.empty() && correct_step();
  double merit = merit_at_step();
  if (corrected && !is_accepted(merit)) {
    step_ = full;
    y_ = multipliers;
    merit = merit_at_step();
  }
  if (!is_accepted(merit)) {
    nlp_.reset();
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
  add_transposed_product(nlp_.jacobian_pattern(), jacobian_, y_, trial_gradient_);
  cholesky_.solve_lower(trial_gradient_);
  return 0.5 * trial_gradient_.squaredNorm();
}

}  // namespace tandem::detail
