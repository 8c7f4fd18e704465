#include <algorithm>
#include <cmath>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/augmented_model.hpp>
#include <tandem/solvers/first_order_check.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/stationary_violation.hpp>

namespace tandem::detail {
namespace {

constexpr int kMaxActiveSets = 10;          // Maximum number of active sets per step; two or three are usual.
constexpr int kMaxSegmentTrials = 40;       // Maximum number of trial points of the search along a segment.
constexpr double kSegmentTolerance = 1e-9;  // For the slope relative to its initial value, and for the interval length.
constexpr double kMinActiveSetGain = 0.01;  // Minimum gain of one more active set, relative to the predicted decrease.
constexpr double kReducedCurvature = 0.3;   // Fraction of the curvature that is tried before it is dropped.
constexpr double kModeratePenalty = 1e4;    // Penalty limit after good steps; more is ill-conditioned.
constexpr double kMaxPenalty = 1e10;        // Penalty limit after stalled steps.
constexpr double kPenaltyGrowth = 10;
constexpr double kFallingViolation = 0.1;  // Ratio of the violations after and before a step that makes progress.
constexpr int kMaxRelaxations = 60;        // maximum number of penalty reductions
constexpr int kStalledSteps = 3;           // steps without less violation before the penalty grows
constexpr int kInfeasibilitySteps = 15;    // steps without less violation between tests of infeasibility
constexpr double kInfeasibilitySlope = 1e-2;
// Number of consecutive damped steps that enable the exact Hessian, and of undamped steps that disable it.
constexpr int kHessianSteps = 3;

}  // namespace

AugmentedModel::AugmentedModel(NlpEvaluator& nlp, Session& session, const LevenbergMarquardtOptions& options,
                               double penalty)
    : SoftModel(nlp, session, options, true),
      options_(options),
      constrained_((nlp.soft_weights().array() == 0).any()),
      term_(nlp),
      lagrangian_secant_(parts_, nlp.num_unknowns(), options.secant_pairs, true),
      penalty_(penalty) {
  for (Eigen::VectorXd* v : {&total_, &last_lagrangian_, &newton_step_, &hessian_step_, &hessian_newton_})
    v->setZero(nlp.num_unknowns());
  for (Eigen::VectorXd* v : {&augmented_hessian_, &damped_hessian_, &curvature_}) v->resize(hessian_.size());
  for (Eigen::VectorXd* v : {&next_multipliers_, &multipliers_here_}) v->setZero(nlp.num_rows());
}

void AugmentedModel::restart(double penalty) {
  penalty_ = penalty;
  best_ = BestPoint{kConstraintTolerance};
  minimized_ = std::numeric_limits<double>::infinity();
  taken_ = stalled_ = relaxed_ = strongly_damped_ = undamped_ = 0;
  exact_ = false;
  clear_curvature();
  curvature_share_ = 0.0;
  next_multipliers_.setZero();
  term_.set_penalty(penalty);
}

void AugmentedModel::drop_multipliers() {
  next_multipliers_.setZero();
  term_.set_multipliers(next_multipliers_);
}

void AugmentedModel::add_curvature() {
  const Session::Timer timer(session_.summary.evaluation_seconds);
  try {
    nlp_.curvature(next_multipliers_, curvature_);
    curvature_share_ = 1.0;
  } catch (const UndefinedResidualError&) {  // a residual is undefined at a finite-difference point
    curvature_share_ = 0.0;
  }
}

bool AugmentedModel::reduce_curvature() {
  if (!has_curvature()) return false;
  curvature_share_ = curvature_share_ == 1.0 && !exact_ ? kReducedCurvature : 0.0;
  return true;
}

double AugmentedModel::linearize() {
  const double cost = SoftModel::linearize();
  curvature_share_ = 0.0;  // the first step uses Gauss-Newton
  term_.linearize();
  if (flat_cost_) find_scale();  // which needs the constraints
  return cost + term_.soft_value();
}

void AugmentedModel::begin() {
  if (options_.from_multipliers) nlp_.multipliers(next_multipliers_);
  start();
}

/// Starts with a penalty that keeps the steps near the constraints.
void AugmentedModel::begin_after_restoration() {
  next_multipliers_.setZero();
  penalty_ = std::max(penalty_, kModeratePenalty);
  minimized_ = std::numeric_limits<double>::infinity();
  stalled_ = relaxed_ = 0;
  start();
}

void AugmentedModel::start() {
  term_.start(scale_);
  term_.set_penalty(penalty_);
  violation_.size = std::numeric_limits<double>::infinity();
  term_.set_multipliers(next_multipliers_);
  on_new_point();
  // The multipliers of a linear model may be worse than none if the point is far from feasible.
  recent_optimality_.fill(optimality());
}

std::string AugmentedModel::nonfinite_block() {
  const int row = term_.nonfinite_row();
  return row < 0 ? SoftModel::nonfinite_block() : nlp_.describe_row(row);
}

double AugmentedModel::gradient_size() {
  total_ = gradient_;
  term_.begin_step();
  term_.add_gradient(total_);
  return scaled(total_);
}

/// Minimises the model. A semismooth Newton iteration finds the active rows. A correct initial active set needs one
/// linear solve.
bool AugmentedModel::find_step(double damping) {
  restore_hessian();
  falling_ = false;
  const Session::Timer timer(session_.summary.linear_solver_seconds);
  total_ = gradient_;
  if (inexact_steps_)
    term_.begin_step_with_predicted_rows();
  else
    term_.begin_step();
  term_.add_gradient(total_);
  step_.setZero();
  hessian_step_.setZero();
  predicted_ = 0.0;
  each_block_column([this](Eigen::Index begin, Eigen::Index size) {
    augmented_hessian_.segment(begin, size) = hessian_.segment(begin, size);
    if (has_curvature()) augmented_hessian_.segment(begin, size) += curvature_share_ * curvature_.segment(begin, size);
  });
  term_.add_hessian(augmented_hessian_);
  for (int set = 1;; ++set) {
    damp(augmented_hessian_, damping, damped_hessian_);
    if (!cholesky_.factorize_in_place(damped_hessian_)) return false;
    newton_step_ = -total_;
    lagrangian_secant_.refresh([&](const Eigen::VectorXd& s, Eigen::VectorXd& y) { term_.add_hessian_product(s, y); });
    lagrangian_secant_.apply(newton_step_, [&](Eigen::VectorXd& d) { cholesky_.solve(d); });
    hessian_newton_ = gradient_;
    term_.set_segment(newton_step_, hessian_newton_);
    hessian_newton_ = -hessian_newton_;
    const bool same = term_.same_active_rows_at_end();
    const double fraction = same ? 1.0 : best_fraction();
    step_ += fraction * (newton_step_ - step_);
    hessian_step_ += fraction * (hessian_newton_ - hessian_step_);
    term_.advance(fraction);
    const double before = predicted_;
    predicted_ = model_decrease();
    if (same || set == kMaxActiveSets) break;
    if (inexact_steps_ && set > 1 && predicted_ - before < kMinActiveSetGain * predicted_) break;
    total_ = gradient_;
    term_.add_gradient(total_);
    term_.change_hessian(augmented_hessian_);
  }
  return true;
}

double AugmentedModel::model_decrease() const {
  const double here = term_.value() + term_.soft_value();
  return -(gradient_.dot(step_) + 0.5 * hessian_step_.dot(step_) + term_.model_value() - here);
}

/// Returns the minimiser of the convex model on the segment from step_ to newton_step_, as a fraction of the segment.
double AugmentedModel::best_fraction() const {
  const double at_start = (newton_step_ - step_).dot(gradient_ + hessian_step_);
  const double growth = (newton_step_ - step_).dot(hessian_newton_ - hessian_step_);
  const auto slope = [&](double t) { return at_start + t * growth + term_.slope(t); };
  double low = 0, high = 1, at_low = slope(low), at_high = slope(high);
  if (at_high <= 0) return 1.0;
  // The slope is increasing and piecewise linear: regula falsi with halved end values (Illinois method).
  const double flat = kSegmentTolerance * std::abs(at_low);
  double middle = 0;
  for (int i = 0, side = 0; i < kMaxSegmentTrials && high - low > kSegmentTolerance; ++i) {
    middle = at_low < 0 ? low + (high - low) * at_low / (at_low - at_high) : 0.5 * (low + high);
    const double s = slope(middle);
    if (std::abs(s) <= flat) break;
    if (s <= 0) {
      low = middle;
      at_low = s;
      if (side < 0) at_high *= 0.5;
      side = -1;
    } else {
      high = middle;
      at_high = s;
      if (side > 0) at_low *= 0.5;
      side = 1;
    }
  }
  return middle;
}

double AugmentedModel::merit_at_step(bool with_derivatives) {
  const double cost = SoftModel::merit_at_step(with_derivatives);
  if (!std::isfinite(cost)) return cost;
  const Session::Timer timer(session_.summary.evaluation_seconds);
  try {
    const double of_hard = term_.value_at_point(with_derivatives);
    trial_cost_ += term_.soft_value_at_point();
    return trial_cost_ + of_hard;
  } catch (const UndefinedResidualError&) {
    return std::numeric_limits<double>::infinity();
  }
}

/// Applies a second-order correction. If rows are curved, a good full step violates them to second order, and the
/// penalty rejects it (Maratos 1978). The correction uses the row values at the rejected step (Nocedal & Wright 2006,
/// §18.3).
double AugmentedModel::merit_at_corrected_step(double damping) {
  const double predicted = predicted_;
  try {
    term_.correct(step_);
  } catch (const UndefinedResidualError&) {
    return std::numeric_limits<double>::infinity();
  }
  const bool found = find_step(damping);
  predicted_ = predicted;
  return found ? merit_at_step(false) : std::numeric_limits<double>::infinity();
}

void AugmentedModel::lagrangian_gradient(const Eigen::VectorXd& multipliers, Eigen::VectorXd& gradient) const {
  gradient = gradient_;
  term_.add_row_gradients(multipliers, gradient);
}

void AugmentedModel::estimate_multipliers_at_step() {
  term_.estimate_at_step(next_multipliers_);
  if (options_.secant_pairs > 0) lagrangian_gradient(next_multipliers_, last_lagrangian_);  // for add_secant_pair()
}

void AugmentedModel::add_secant_pair() {
  if (exact_) return;
  lagrangian_gradient(next_multipliers_, total_);
  lagrangian_secant_.add(step_, last_lagrangian_, total_);
}

/// Raises the scale of unknowns that the cost does not curve to the smallest positive one. Such unknowns are then
/// damped, and the constraints on them get a finite weight. If the cost curves no unknown, the constraints give the
/// scale.
void AugmentedModel::find_scale() {
  SoftModel::find_scale();
  const double stiffest = scale_.maxCoeff();
  flat_cost_ = !(stiffest > 0);
  if (flat_cost_) term_.find_scale(scale_);
  if (all_curved_ || flat_cost_) return;
  double softest = stiffest;
  for (const double s : scale_)
    if (s > 0) softest = std::min(softest, s);
  softest = std::max(softest, min_curvature(scale_));
  for (double& s : scale_)
    if (!(s > 0)) s = softest;
}

void AugmentedModel::linearize_constraints() {
  if (trial_has_derivatives_)
    term_.accept_point();
  else
    term_.linearize();
}

void AugmentedModel::on_new_point() {
  const double before = violation_.size;
  violation_ = term_.violation();
  falling_ = violation_.size < kFallingViolation * before;
  only_rounding_.reset();
  const double size = feasible() ? std::min(violation_.size, kConstraintTolerance) : violation_.size;
  if (best_.offer(session_.summary.cost, size)) nlp_.save();
  if (exact_) add_curvature();
}

/// The rounding errors of the rows are evaluated only if the violation no longer falls, because this takes time.
bool AugmentedModel::feasible() {
  if (violation_.size <= kConstraintTolerance) return true;
  if (falling_) return false;
  if (!only_rounding_) only_rounding_ = term_.is_met(kConstraintTolerance);
  return *only_rounding_;
}

/// Enables the exact Hessian of the Lagrangian while steps need strong damping. Far from feasible, multipliers and
/// constraint curvature are large, and a few secant pairs cannot represent them.
void AugmentedModel::choose_hessian(const StepQuality& quality) {
  strongly_damped_ = quality.strongly_damped ? strongly_damped_ + 1 : 0;
  undamped_ = quality.undamped ? undamped_ + 1 : 0;
  if (!exact_ && strongly_damped_ > kHessianSteps) {
    exact_ = true;
    clear_curvature();
    estimate_multipliers();
    add_curvature();
  } else if (exact_ && undamped_ > kHessianSteps) {
    exact_ = false;
    curvature_share_ = 0.0;
  }
}

double AugmentedModel::optimality() {
  if (!constrained_) return 0.0;
  multipliers_here_ = next_multipliers_;
  term_.set_soft_multipliers(multipliers_here_);
  lagrangian_gradient(multipliers_here_, total_);
  return std::max(scaled(total_), term_.complementarity(next_multipliers_));
}

void AugmentedModel::set_penalty(double penalty) {
  penalty_ = penalty;
  term_.set_penalty(penalty);
}

void AugmentedModel::accept_multipliers() {
  term_.set_multipliers(next_multipliers_);
  if (penalty_ < kModeratePenalty) set_penalty(penalty_ * kPenaltyGrowth);
}

void AugmentedModel::update_multipliers(double ratio) {
  const double residual = optimality();
  if (residual <= *std::max_element(recent_optimality_.begin(), recent_optimality_.end())) {
    recent_optimality_[std::size_t(taken_++) % recent_optimality_.size()] = residual;
  } else {
    estimate_multipliers();
    lagrangian_gradient(next_multipliers_, total_);
    if (scaled(total_) > minimized_) return;
    minimized_ = 0.5 * scaled(total_);
  }
  term_.set_multipliers(next_multipliers_);
  if (ratio > 0.5 && penalty_ < kModeratePenalty) set_penalty(penalty_ * kPenaltyGrowth);
}

bool AugmentedModel::update_penalty(bool no_closer) {
  if (!no_closer || feasible()) {
    stalled_ = 0;
    return false;
  }
  if (++stalled_ % kStalledSteps == 0 && penalty_ < kMaxPenalty) set_penalty(penalty_ * kPenaltyGrowth);
  return stalled_ % kInfeasibilitySteps == 0 && locally_infeasible();
}

bool AugmentedModel::relax_penalty() {
  if (penalty_ <= kModeratePenalty || relaxed_ >= kMaxRelaxations) return false;
  ++relaxed_;
  set_penalty(penalty_ / kPenaltyGrowth);
  return true;
}

bool AugmentedModel::is_solution(double tolerance) {
  if (!constrained_) return false;
  const auto check = check_first_order(nlp_, 0.0);  // 0: an extremum of a residual is no solution
  if (!check || !check->feasible || !(check->stationarity <= tolerance)) return false;
  next_multipliers_ = check->multipliers;
  return true;
}

bool AugmentedModel::locally_infeasible() {
  return !feasible() && term_.infeasibility_slope(scale_) <= kInfeasibilitySlope && violation_is_stationary(nlp_);
}

}  // namespace tandem::detail
