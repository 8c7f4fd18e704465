#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/augmented_model.hpp>
#include <tandem/solvers/damped_step.hpp>
#include <tandem/solvers/levenberg_marquardt.hpp>
#include <tandem/solvers/session.hpp>
#include <tandem/solvers/soft_model.hpp>
#include <tandem/solvers/stationary_violation.hpp>

namespace tandem::detail {
namespace {

constexpr double kExcessiveDamping = 1e16;    // Larger damping gives steps below the resolution of doubles.
constexpr double kNegligibleDamping = 1e-15;  // Adds nothing to a diagonal of doubles.
constexpr double kUndamped = 1e-5;            // Maximum damping of a step that counts as undamped.
constexpr double kStrongDamping = 1e-3;       // Damping above which the model probably lacks curvature.
constexpr double kRounding = 1e-14;           // Relative rounding error of a sum of many costs.
constexpr double kMinAcceptanceRatio = 1e-4;  // Minimum actual over predicted gain of an accepted step.
constexpr double kGoodAcceptanceRatio = 0.1;  // Ratio above which the next step is evaluated with derivatives.
constexpr double kSecantBelow = 1e-2;  // Maximum relative decrease of the cost in a step that gives a secant pair.
constexpr double kOptimality = 1e-5;   // Tolerance on the first-order conditions [standard deviations].
// Relative change of the merit function that may be rounding, as multipliers are large.
constexpr double kMeritRounding = 1e-9;
// A step is near a minimum if the predicted gain is below this fraction of the cost. There, a gain that exceeds the
// prediction by this ratio shows that the model lacks second derivatives. Solves that converge in a few such steps do
// without them.
constexpr double kNearMinimum = 0.05, kUnderestimate = 1.25;
constexpr int kFewSteps = 6;
constexpr int kMaxPolishingSteps = 5;                // Polishing steps in which the first-order residual is not halved.
constexpr double kStalledViolationRatio = 0.9;       // Ratio of the violations after and before a step.
constexpr int kMaxRejected = 10, kManyRejected = 3;  // Rejected minus accepted steps.
constexpr int kMaxRestorations = 3, kMaxJumps = 5;   // Jumps without a lower cost, consecutive.
constexpr double kMinJumpGain = 1e-3;                // Minimum relative decrease of the cost by jumps.

class DampedSteps {
 public:
  DampedSteps(NlpEvaluator& nlp, Session& session, SoftModel& model, const LevenbergMarquardtOptions& options)
      : options_(options), nlp_(nlp), session_(session), model_(model), damping_(fresh_damping()) {}

  void run() {
    auto& s = session_.summary;
    if (!session_.start(nlp_, [this] { return model_.linearize(); })) return;
    model_.begin();
    while (!session_.ended()) {
      if (options_.progress)
        session_.report(s.iterations, s.cost, s.iterations ? model_.step().norm() : 0.0, model_.violation().size);
      if (session_.should_stop()) break;
      if (s.iterations >= options_.max_iterations) {
        session_.end(Status::max_iterations);
        break;
      }
      if (const std::string bad = model_.nonfinite_block(); !bad.empty()) {
        session_.end(Status::failed, "a Jacobian is not finite, in " + bad);
        break;
      }
      if (model_.gradient_size() <= options_.gradient_tolerance * std::sqrt(1 + s.cost) && model_.feasible()) {
        model_.estimate_multipliers();
        if (optimal()) {
          session_.end(Status::converged, "the gradient is below its tolerance");
          break;
        }
        model_.accept_multipliers();  // they refer to bounds that are not active at X̄
      }
      ++s.iterations;
      model_.choose_hessian({damping_.value > kStrongDamping, undamped(), std::exchange(underestimated_, false),
                             std::exchange(rejected_near_minimum_, false)});
      if (try_step() || damping_.value <= kExcessiveDamping) continue;
      if (model_.abandon_exact_hessian())
        damping_ = fresh_damping();
      else
        end_without_progress();
    }
    if (s.status != Status::converged && s.status != Status::infeasible) model_.restore_best();
    if ((s.status == Status::failed || s.status == Status::max_iterations) && model_.is_solution(kOptimality)) {
      s.status = Status::converged;
      s.message = "no step lowers the cost any further";
    }
    if (s.cost > cost_before_jump_) {  // the point after the jump is worse
      model_.restore();
      if (s.status == Status::converged || s.status == Status::failed) {
        s.status = Status::failed;
        s.message = message_at_jump_;
      }
    }
    if (!message_at_jump_.empty() && model_.constrained() && s.status == Status::converged &&
        model_.best_cost() < s.cost * (1 - kMinJumpGain)) {
      model_.restore_best();
      s.status = Status::failed;
      s.message = message_at_jump_;
    }
    if (s.status == Status::converged) model_.store_multipliers();
    const Workspace work = model_.workspace();
    session_.conclude(nlp_, kConstraintTolerance, &work);
  }

 private:
  Damping fresh_damping() const { return {options_.initial_damping, kNegligibleDamping, 1e-12, 4, 2}; }
  double undamped_limit() const { return std::max(options_.initial_damping, kUndamped); }
  /// Returns whether the damping is too small to shorten steps.
  bool undamped() const { return damping_.value <= undamped_limit(); }
  bool optimal() { return model_.optimality() <= kOptimality; }

  bool reject() {
    nlp_.reset();
    damping_.reject();
    rejected_ = std::min(rejected_ + 1, kMaxRejected);
    if (rejected_ >= kManyRejected && model_.relax_penalty()) rejected_ = 0;
    model_.clear_curvature();
    last_step_good_ = false;
    return false;
  }

  /// Tries one step. Returns false if it is rejected.
  bool try_step() {
    auto& s = session_.summary;
    while (!model_.find_step(damping_.value)) {
      if (model_.reduce_curvature()) continue;  // with less curvature, weaker damping is sufficient
      reject();
      if (damping_.value > kExcessiveDamping || session_.should_stop()) return false;
    }
    const double merit = model_.merit(), predicted = model_.predicted();
    double trial = model_.merit_at_step(last_step_good_);
    if (predicted <= kRounding * merit)
      return handle_no_predicted_gain(merit, trial);  // at a solution, or strongly damped
    double ratio = (merit - trial) / predicted;
    const double min_gain = options_.cost_tolerance * s.cost;
    if (predicted > min_gain && predicted <= kNearMinimum * merit && ++near_minimum_ > kFewSteps) {
      rejected_near_minimum_ = !(ratio > kMinAcceptanceRatio);
      underestimated_ = ratio > kUnderestimate;
    }
    if (!(ratio > kMinAcceptanceRatio)) {
      if (undamped() && model_.feasible()) {
        model_.estimate_multipliers_at_step();
        if (predicted <= min_gain && stop_damping(min_gain)) {
          nlp_.reset();
          return false;
        }
        if (predicted <= min_gain && optimal()) {
          session_.end(Status::converged, "the cost no longer changes");
          return true;
        }
      }
      if (merit_is_rounding(merit, trial)) return polish();
      trial = model_.merit_at_corrected_step(damping_.value);
      ratio = (merit - trial) / predicted;
      if (!(ratio > kMinAcceptanceRatio)) {
        model_.drop_correction();
        return reject();
      }
    }
    const double drop = merit - trial, violation_before = model_.violation().size;
    model_.estimate_multipliers_at_step();
    if (!model_.move_on()) return reject();
    polished_ = 0;
    if (undamped() && model_.feasible()) {
      if (drop <= min_gain && predicted <= min_gain && !stop_damping(min_gain) && optimal())
        session_.end(Status::converged, "the cost no longer changes");
      else if (model_.step_size() <= options_.step_tolerance && optimal())
        session_.end(Status::converged, "the step is below its tolerance");
    }
    // While the cost falls fast, curvature changes too much between steps to be reused.
    if (drop <= kSecantBelow * s.cost) model_.add_secant_pair();
    last_step_good_ = ratio > kGoodAcceptanceRatio;
    damping_.accept(ratio);
    rejected_ = std::max(rejected_ - 1, 0);
    model_.update_multipliers(ratio);
    update_penalty(model_.violation().size > kStalledViolationRatio * violation_before &&
                   damping_.value <= kStrongDamping);
    return true;
  }

  /// Ends the damping if it hides a gain. Returns false if it does not.
  bool stop_damping(double min_gain) {
    if (model_.constrained() || damping_.value <= kNegligibleDamping) return false;
    if (!(model_.hidden_gain(damping_.value) > min_gain)) return false;
    damping_.value = kNegligibleDamping;
    return true;
  }

  /// Handles a step without predicted gain beyond rounding.
  bool handle_no_predicted_gain(double merit, double trial) {
    // The weights are so large that rounding dominates the factor.
    if (model_.predicted() < -kMeritRounding * merit) return reject();
    if (model_.feasible()) {
      if (model_.constrained() && std::isfinite(trial)) return polish();
      if (undamped() && stop_damping(options_.cost_tolerance * session_.summary.cost)) {
        nlp_.reset();
        return false;
      }
      if (trial <= merit) model_.move();
      end_without_progress();
      return true;
    }
    if (!undamped()) return reject();
    if (std::isfinite(trial) && model_.violation_at_step() < kStalledViolationRatio * model_.violation().size) {
      model_.estimate_multipliers_at_step();  // the merit function hides the progress, as it is large
      if (!model_.move_on()) return reject();
      model_.accept_multipliers();
      return true;
    }
    nlp_.reset();
    model_.estimate_multipliers();
    model_.accept_multipliers();
    update_penalty(true);
    return true;
  }

  /// Returns whether changes of the merit function are below its rounding error.
  bool merit_is_rounding(double merit, double trial) const {
    const double rounding = kMeritRounding * merit;
    return model_.constrained() && undamped() && model_.predicted() <= rounding && trial - merit <= rounding;
  }

  /// Accepts steps while they reduce the residual of the optimality conditions. For use if the merit function cannot
  /// rank steps.
  bool polish() {
    model_.estimate_multipliers_at_step();
    const double before = model_.optimality();
    if (!model_.move_on()) return reject();
    const double after = model_.optimality();
    if (model_.feasible() && after <= kOptimality) {
      session_.end(Status::converged, "no step lowers the cost any further");
    } else if (after > 0.5 * before && ++polished_ > kMaxPolishingSteps) {
      end_without_progress();
    } else {
      model_.accept_multipliers();
    }
    return true;
  }

  /// Takes undamped steps as polish() does, after rounding has caused rejections of damped ones. Returns whether they
  /// reach a solution.
  bool final_polish() {
    for (int step = 0; step < kMaxPolishingSteps; ++step) {
      while (!model_.find_step(undamped_limit()))
        if (!model_.reduce_curvature()) return false;
      const double merit = model_.merit(), rounding = kMeritRounding * merit;
      if (std::abs(model_.predicted()) > rounding || !(model_.merit_at_step(true) - merit <= rounding)) return false;
      model_.estimate_multipliers_at_step();
      if (!model_.move_on()) return false;
      if (model_.feasible() && optimal()) {
        session_.end(Status::converged, "no step lowers the cost any further");
        return true;
      }
      model_.accept_multipliers();
    }
    return false;
  }

  /// Linearises at X̄ without secant pairs. Returns false and ends the solve if the derivatives are undefined.
  bool linearize_gauss_newton() {
    nlp_.reset();
    model_.clear_curvature();
    try {
      session_.summary.cost = model_.linearize();
      return true;
    } catch (const UndefinedResidualError& e) {
      session_.end(Status::failed, std::string("a residual's derivatives are undefined: ") + e.what());
      return false;
    }
  }

  void update_penalty(bool stalled) {
    if (model_.update_penalty(stalled)) restore_feasibility();
  }

  /// Minimises the violation, for use if the merit function keeps X̄ infeasible. Continues from a feasible point, and
  /// ends the solve at a stationary point of the violation.
  void restore_feasibility() {
    const LeastViolation end = ++restorations_ > kMaxRestorations
                                   ? LeastViolation::unfinished
                                   : minimize_violation(nlp_, [this] { return session_.should_stop(); });
    if (session_.ended() || !linearize_gauss_newton()) return;
    model_.begin_after_restoration();
    damping_ = fresh_damping();
    rejected_ = polished_ = 0, last_step_good_ = true;
    if (end == LeastViolation::feasible) return;
    const std::string worst = "the worst is " + nlp_.describe_row(model_.violation().row);
    if (end == LeastViolation::stationary)
      session_.end(Status::infeasible, "no small step reduces the violation of the hard constraints; " + worst);
    else
      end_as_failed("no step makes progress, and hard constraints are violated; " + worst);
  }

  /// Ends as failed, or crosses a discontinuity along the step if there is one.
  void end_as_failed(std::string message) {
    const NlpEvaluator::DerivativeCheck check = nlp_.check_derivatives(model_.step());
    message += derivative_hint(check);
    if (check.kind != NlpEvaluator::DerivativeCheck::Kind::jump || !cross_jump(message))
      session_.end(Status::failed, message);
  }

  /// Ends as converged if an undamped Gauss-Newton step gains nothing either, otherwise as failed.
  void end_without_progress() {
    if (!linearize_gauss_newton()) return;
    if (!model_.feasible()) return restore_feasibility();
    if (model_.constrained() && (final_polish() || !linearize_gauss_newton())) return;
    const double min_gain = std::max(options_.cost_tolerance, kRounding) * session_.summary.cost;
    std::string message = "no step lowers the cost, not even a short one";
    if (model_.constrained()) message = "no step reduces the residual of the optimality conditions";
    const bool gains_nothing = model_.find_step(undamped_limit()) && model_.predicted() <= min_gain;
    if (gains_nothing) {
      model_.estimate_multipliers_at_step();
      if (optimal()) return session_.end(Status::converged, "no step lowers the cost any further");
    }
    end_as_failed(std::move(message));
  }

  /// Crosses a discontinuity of a residual, for example a rotation by π. There all short steps may increase the cost
  /// although the cost beyond is lower. The first attempt takes the longest step, each further one a shorter step. The
  /// best point before is saved here or, with hard constraints, by the model.
  bool cross_jump(const std::string& message) {
    const double cost = session_.summary.cost;
    if (cost < min_cost_at_jump_ * (1 - kMinJumpGain)) jumps_ = 0;
    min_cost_at_jump_ = std::min(min_cost_at_jump_, cost);
    if (!model_.constrained())
      save_before_jump(message);
    else if (message_at_jump_.empty())
      message_at_jump_ = message;
    if (++jumps_ > kMaxJumps) return false;
    double damping = undamped_limit();  // the longest step first
    for (int i = 1; i < jumps_; ++i) damping *= 10;
    if (!model_.find_step(damping) || !std::isfinite(model_.merit_at_step(true)) || !model_.move_on()) return false;
    damping_ = fresh_damping();
    model_.reset_penalty_counters();
    rejected_ = 0;
    last_step_good_ = false;
    return true;
  }

  void save_before_jump(const std::string& message) {
    if (session_.summary.cost >= cost_before_jump_) return;
    cost_before_jump_ = session_.summary.cost;
    message_at_jump_ = message;
    nlp_.save();
  }

  const LevenbergMarquardtOptions& options_;
  NlpEvaluator& nlp_;
  Session& session_;
  SoftModel& model_;
  Damping damping_;
  bool last_step_good_ = true;
  bool underestimated_ = false, rejected_near_minimum_ = false;  // SoftModel::StepQuality of the last step
  int near_minimum_ = 0;                                         // number of steps near a minimum
  int polished_ = 0;
  int rejected_ = 0;  // rejected steps minus later accepted ones
  int restorations_ = 0, jumps_ = 0;
  double min_cost_at_jump_ = std::numeric_limits<double>::infinity();  // least cost at a jump
  // Cost of the saved point; only without hard constraints.
  double cost_before_jump_ = std::numeric_limits<double>::infinity();
  std::string message_at_jump_;  // failure message at the jump
};

}  // namespace

struct LevenbergMarquardt::Parts {
  Parts(Problem& problem, const char* solver, const LevenbergMarquardtOptions& given)
      : options(given), session(solver, given), nlp(problem, SoftBoundRole::as_rows, in_elimination_order) {
    nlp.use_threads(given.threads);
    if (nlp.num_rows() > 0) {
      model = std::make_unique<AugmentedModel>(nlp, session, options, 0.0);
    } else {
      model = std::make_unique<SoftModel>(nlp, session, options);
    }
  }

  const LevenbergMarquardtOptions& options;
  Session session;
  NlpEvaluator nlp;
  std::unique_ptr<SoftModel> model;
  bool used = false;
};

LevenbergMarquardt::LevenbergMarquardt(Problem& problem, const char* solver, const LevenbergMarquardtOptions& options,
                                       const double* penalty)
    : parts_(std::make_unique<Parts>(problem, solver, options)), penalty_(penalty) {}
LevenbergMarquardt::~LevenbergMarquardt() = default;

bool LevenbergMarquardt::is_current() const { return parts_->nlp.is_current(); }

Summary LevenbergMarquardt::solve() {
  if (std::exchange(parts_->used, true)) parts_->session.restart();  // the analysis counts as time of the first solve
  parts_->nlp.use_threads(parts_->options.threads);
  parts_->nlp.reset();
  parts_->model->restart(penalty_ ? *penalty_ : 0.0);
  DampedSteps(parts_->nlp, parts_->session, *parts_->model, parts_->options).run();
  return parts_->session.summary;
}

}  // namespace tandem::detail
