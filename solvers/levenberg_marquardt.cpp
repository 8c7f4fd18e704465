#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <tandem/solvers/augmented_term.hpp>
#include <tandem/solvers/levenberg_marquardt.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/secant.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMaxDamping = 1e16;
constexpr double kSmallestDamping = 1e-15;
constexpr double kSecantBelow = 1e-2;  // relative drop of the cost in one step

constexpr int kMostActiveSets = 10;    // tried for one step
constexpr double kUsualPenalty = 1e4;  // grown to while steps are good
constexpr double kMostPenalty = 1e10;  // grown to while the constraints do not come closer
constexpr double kPenaltyGrowth = 10;
constexpr int kStalledSteps = 3;    // with hardly less violation, before the penalty grows
constexpr int kHopelessSteps = 15;  // and before the constraints are given up
constexpr double kHopelessRelief = 1e-2;
constexpr double kStrongDamping = 1e-3;  // a step so damped shows that curvature is missing
constexpr int kDampedSteps = 3;          // of them, before the exact Hessian is used

class LevenbergMarquardt {
 public:
  LevenbergMarquardt(Problem& problem, const char* solver, const LevenbergMarquardtOptions& options, double penalty)
      : options_(options),
        session_(solver, options),
        program_(problem),
        term_(program_),
        cholesky_(program_.hessian_pattern()),
        secant_(program_.num_unknowns(), options.secant_pairs, !term_.empty()),
        damping_(options.initial_damping),
        penalty_(penalty) {
    for (Eigen::VectorXd* v :
         {&gradient_, &trial_gradient_, &total_, &scale_, &shift_, &step_, &next_, &bent_, &bent_next_})
      v->setZero(program_.num_unknowns());
    hessian_.setZero(static_cast<Eigen::Index>(program_.hessian_pattern().row.size()));
    trial_hessian_ = hessian_;
    if (!term_.empty()) augmented_ = hessian_;
    next_multipliers_.setZero(program_.num_rows());
    recent_mismatch_.fill(kInfinity);
  }

  Summary run() {
    auto& s = session_.summary;
    if (!session_.start(program_, [this] { return linearize(); })) return s;
    update_scale();
    term_.linearize();
    term_.start(scale_);
    term_.set_penalty(penalty_);
    arrive();
    while (!session_.ended()) {
      session_.report(s.iterations, s.cost, s.iterations ? step_.norm() : 0.0, violation_);
      if (session_.should_stop()) break;
      if (s.iterations >= options_.max_iterations) {
        session_.end(Status::max_iterations);
        break;
      }
      total_ = gradient_;
      term_.begin_step();
      term_.add_gradient(total_);
      if (!std::isfinite(total_.sum()) || !std::isfinite(scale_.sum())) {
        program_.reset();
        const int row = term_.bad_row();
        session_.end(Status::failed, "a Jacobian is not finite, in " +
                                         (row < 0 ? program_.describe_bad_block() : program_.describe_row(row)));
        break;
      }
      if (feasible() && scaled(total_) <= options_.gradient_tolerance * std::sqrt(1 + s.cost)) {
        session_.end(Status::converged, "the gradient vanished");
        break;
      }
      ++s.iterations;
      if (!term_.empty() && !exact_ && damping_ > kStrongDamping && ++damped_ > kDampedSteps) turn_exact();
      const bool accepted = try_step();
      if (!accepted && damping_ > kMaxDamping) end_when_nothing_is_left();
    }
    if (!term_.empty() && s.status != Status::converged) program_.restore();
    session_.conclude(program_, kConstraintTolerance);
    return s;
  }

 private:
  double linearize() {
    const Session::Timer timer(session_.summary.evaluation_seconds);
    ++session_.summary.evaluations;
    return program_.linearize(gradient_, hessian_);
  }

  /// The Hessian's diagonal, the scale of each unknown.
  void update_scale() { hessian_diagonal(program_.hessian_pattern(), hessian_, scale_); }

  /// Largest |g| in units in which each unknown has unit curvature.
  double scaled(const Eigen::VectorXd& gradient) const {
    double largest = 0;
    for (Eigen::Index i = 0; i < gradient.size(); ++i)
      if (scale_[i] > 0) largest = std::max(largest, std::abs(gradient[i]) / std::sqrt(scale_[i]));
    return largest;
  }

  /// Far from feasible, multipliers are large and so is the curvature of the constraints, which a few secant pairs do
  /// not make up for: the Lagrangian's exact Hessian from now on. It costs some twenty linearisations.
  void turn_exact() {
    const Session::Timer timer(session_.summary.evaluation_seconds);
    exact_ = true;
    secant_.clear();
    term_.estimate(next_multipliers_);
    evaluate_exactly();
  }

  void evaluate_exactly() {
    try {
      program_.exact_hessian(1.0, next_multipliers_, hessian_);
    } catch (const Error&) {  // a residual is undefined nearby, where differences are taken
      program_.linearize(gradient_, hessian_);
    }
  }

  bool feasible() const { return violation_ <= kConstraintTolerance; }

  /// Takes note of X̄: its merit, and whether it is the best point so far.
  void arrive() {
    if (term_.empty()) return;
    violation_ = term_.violation().size;
    const double cost = session_.summary.cost;
    const bool better =
        feasible() && best_violation_ <= kConstraintTolerance ? cost <= best_cost_ : violation_ <= best_violation_;
    if (!better) return;
    best_cost_ = cost;
    best_violation_ = violation_;
    program_.keep();
  }

  bool factorize() {
    if (!term_.empty()) {
      augmented_ = hessian_;
      term_.add_hessian(augmented_);
    }
    const Eigen::VectorXd& H = term_.empty() ? hessian_ : augmented_;
    // An unknown that no residual curves still gets a pivot, and then no step.
    shift_ = (damping_ * scale_).cwiseMax(std::numeric_limits<double>::min());
    if (!(scale_.minCoeff() > 0)) {
      hessian_diagonal(program_.hessian_pattern(), H, next_);
      for (Eigen::Index i = 0; i < shift_.size(); ++i)
        if (!(next_[i] > 0)) shift_[i] = 1.0;
    }
    return cholesky_.factorize(H, shift_);
  }

  /// The step to the least value of the model, the active rows found by a semismooth Newton iteration, and what it
  /// gains: the model's decrease. Without rows, and where the first guess of the active ones is right, one linear solve.
  bool find_step() {
    const Session::Timer timer(session_.summary.linear_solver_seconds);
    step_.setZero();
    bent_.setZero();  // Hessian times step_, by the equations that it solved
    for (int set = 1;; ++set) {
      if (!factorize()) return false;
      next_ = -total_;
      if (!term_.empty()) secant_.refresh([&](const auto& s, auto&& y) { term_.add_hessian_product(s, y); });
      secant_.apply(next_, [&](Eigen::VectorXd& d) { cholesky_.solve(d); });
      bent_next_ = gradient_;
      term_.aim(next_, bent_next_);
      bent_next_ = -bent_next_;
      const bool settled = term_.settled();
      const double fraction = settled ? 1.0 : best_fraction();
      step_ += fraction * (next_ - step_);
      bent_ += fraction * (bent_next_ - bent_);
      term_.advance(fraction);
      if (settled || set == kMostActiveSets) break;
      total_ = gradient_;
      term_.add_gradient(total_);
    }
    predicted_ = -(gradient_.dot(step_) + 0.5 * bent_.dot(step_) + term_.model_value() - term_.value());
    return true;
  }

  /// Where the convex model is least on the segment from step_ to next_.
  double best_fraction() const {
    const double at_start = (next_ - step_).dot(gradient_ + bent_), growth = (next_ - step_).dot(bent_next_ - bent_);
    const auto slope = [&](double t) { return at_start + t * growth + term_.slope(t); };
    if (slope(1.0) <= 0) return 1.0;
    double low = 0, high = 1;
    for (int i = 0; i < 30; ++i) {
      const double middle = 0.5 * (low + high);
      (slope(middle) <= 0 ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }

  /// Cost after the step. While steps are good, with the derivatives there, since they will be wanted next.
  double merit_at_step() {
    const Session::Timer timer(session_.summary.evaluation_seconds);
    ++session_.summary.evaluations;
    try {
      program_.move_to(step_);
      trial_cost_ = confident_ ? program_.linearize_at_point(trial_gradient_, trial_hessian_) : program_.cost();
      return trial_cost_ + term_.value_at_point();
    } catch (const Error&) {
      return kInfinity;  // undefined there: shorten the step
    }
  }

  void accept() {
    program_.recenter();
    session_.summary.cost = trial_cost_;
  }

  /// Derivatives at the point just accepted.
  void adopt_derivatives() {
    const Session::Timer timer(session_.summary.evaluation_seconds);
    if (!confident_) program_.linearize(trial_gradient_, trial_hessian_);
    gradient_.swap(trial_gradient_);  // the trial's is now the last one
    hessian_.swap(trial_hessian_);
    update_scale();
    term_.linearize();
    arrive();
    if (exact_) evaluate_exactly();
  }

  bool refuse() {
    program_.reset();
    damping_ = std::max(damping_, 1e-12) * growth_;
    growth_ *= 2;
    secant_.clear();
    confident_ = false;
    return false;
  }

  /// One trial step; the damping and its growth follow Nielsen (1999).
  bool try_step() {
    auto& s = session_.summary;
    if (!find_step()) return refuse();
    const double merit = s.cost + term_.value(), trial = merit_at_step();
    const double noise = 1e-14 * merit;  // differences below this are rounding
    const double least = options_.cost_tolerance * s.cost;
    const bool free_step = damping_ <= options_.initial_damping;  // else the damping made it small
    if (predicted_ <= noise) {                                    // at a solution, or damped until nothing moves
      if (feasible()) {
        if (trial <= merit) accept();
        end_when_nothing_is_left();
        return true;
      }
      if (!free_step) return refuse();
      program_.reset();
      term_.estimate(next_multipliers_);
      term_.set_multipliers(next_multipliers_);
      tighten(true);
      return true;
    }
    const double ratio = (merit - trial) / predicted_;
    if (!(ratio > 1e-4)) {
      if (predicted_ <= least && free_step && feasible()) {
        session_.end(Status::converged, "the cost changes no more");
        return true;
      }
      return refuse();
    }
    const double drop = merit - trial, before = violation_;
    accept();
    term_.estimate_at_step(next_multipliers_);
    term_.add_forces(next_multipliers_, gradient_);
    adopt_derivatives();
    if (feasible() && free_step && drop <= least && predicted_ <= least) {
      session_.end(Status::converged, "the cost changes no more");
    } else if (feasible() && free_step && step_.cwiseAbs().maxCoeff() <= options_.step_tolerance) {
      session_.end(Status::converged, "the steps have become too small to matter");
    }
    total_ = gradient_;
    term_.add_forces(next_multipliers_, total_);
    // Far away, where the cost still falls fast, the curvature of one place says little about the next.
    if (!exact_ && drop <= kSecantBelow * s.cost) secant_.add(step_, trial_gradient_, total_);
    confident_ = ratio > 0.1;
    damping_ = std::max(kSmallestDamping, damping_ * std::max(0.1, 1 - std::pow(2 * ratio - 1, 3)));
    growth_ = 4;
    if (!term_.empty()) {
      const bool taken = update_multipliers();
      if (taken && ratio > 0.5 && penalty_ < kUsualPenalty) set_penalty(penalty_ * kPenaltyGrowth);
      tighten(violation_ > 0.9 * before && damping_ <= kStrongDamping);
    }
    return true;
  }

  void set_penalty(double penalty) {
    penalty_ = penalty;
    term_.set_penalty(penalty);
  }

  /// Takes the multipliers of the model's minimum while they bring the optimality conditions closer; else those of
  /// the classical method, once the augmented Lagrangian is minimised.
  bool update_multipliers() {
    const double mismatch = std::max(scaled(total_), term_.mismatch(next_multipliers_));
    if (mismatch <= *std::max_element(recent_mismatch_.begin(), recent_mismatch_.end())) {
      recent_mismatch_[std::size_t(taken_++) % recent_mismatch_.size()] = mismatch;
      term_.set_multipliers(next_multipliers_);
      return true;
    }
    term_.estimate(next_multipliers_);
    total_ = gradient_;
    term_.add_forces(next_multipliers_, total_);
    if (scaled(total_) > minimized_) return false;
    minimized_ = 0.5 * scaled(total_);
    term_.set_multipliers(next_multipliers_);
    return true;
  }

  /// Where the constraints come no closer, they get more weight, and are given up at last.
  void tighten(bool no_closer) {
    if (feasible() || !no_closer) {
      stalled_ = 0;
      return;
    }
    if (++stalled_ % kStalledSteps == 0 && penalty_ < kMostPenalty) set_penalty(penalty_ * kPenaltyGrowth);
    if (stalled_ >= kHopelessSteps && term_.relief(scale_) <= kHopelessRelief) end_infeasible();
  }

  void end_infeasible() {
    session_.end(Status::infeasible, "no small step brings the hard constraints closer together; the worst is " +
                                         program_.describe_row(term_.violation().row));
  }

  /// Converged when a Gauss-Newton step would gain nothing either, failed when it would.
  void end_when_nothing_is_left() {
    program_.reset();
    secant_.clear();
    linearize();
    update_scale();
    term_.linearize();
    if (!feasible() && term_.relief(scale_) <= kHopelessRelief) return end_infeasible();
    total_ = gradient_;
    term_.begin_step();
    term_.add_gradient(total_);
    damping_ = options_.initial_damping;
    const double least = std::max(options_.cost_tolerance, 1e-14) * session_.summary.cost;
    if (feasible() && find_step() && predicted_ <= least) {
      session_.end(Status::converged, "no step lowers the cost any further");
    } else if (!feasible()) {
      session_.end(Status::failed, "no step brings the optimum closer while a hard constraint is violated, worst " +
                                       program_.describe_row(term_.violation().row));
    } else {
      session_.end(Status::failed, "no step lowers the cost, however short: is a Jacobian wrong?");
    }
  }

  const LevenbergMarquardtOptions& options_;
  Session session_;
  Program program_;
  AugmentedTerm term_;
  BlockCholesky cholesky_;
  SecantPairs secant_;
  double damping_, growth_ = 4, predicted_ = 0, trial_cost_ = 0;

  bool confident_ = true;  // the last step was good
  Eigen::VectorXd gradient_, trial_gradient_, total_, scale_, shift_, step_, next_, bent_, bent_next_;
  Eigen::VectorXd hessian_, trial_hessian_, augmented_;
  // Of the hard constraints.
  double penalty_, violation_ = 0, best_violation_ = kInfinity, best_cost_ = kInfinity, minimized_ = kInfinity;
  int stalled_ = 0, taken_ = 0, damped_ = 0;
  bool exact_ = false;  // hessian_ is the Lagrangian's own
  std::array<double, 5> recent_mismatch_;
  Eigen::VectorXd next_multipliers_;
};

}  // namespace

Summary levenberg_marquardt(Problem& problem, const char* solver, const LevenbergMarquardtOptions& options,
                            double penalty) {
  return LevenbergMarquardt(problem, solver, options, penalty).run();
}

void check(const char* solver, const LevenbergMarquardtOptions& options) {
  if (!(options.cost_tolerance >= 0) || !(options.gradient_tolerance >= 0) || !(options.step_tolerance >= 0) ||
      !(options.initial_damping >= 0) || options.secant_pairs < 0)
    throw Error(std::string(solver) + ": tolerances, initial_damping and secant_pairs must not be negative");
}

}  // namespace tandem::detail
