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

namespace tandem::detail {
namespace {

constexpr double kUselessDamping = 1e16;  // a step damped so does not move doubles
constexpr double kNoDamping = 1e-15;      // adds nothing to a diagonal of doubles
constexpr double kFreeDamping = 1e-5;     // steps damped more than this may be short for that reason alone
constexpr double kStrongDamping = 1e-3;   // a step so damped shows that curvature is missing
constexpr double kRounding = 1e-14;       // relative difference of costs that is rounding, summed over many residuals
constexpr double kAccepted = 1e-4;        // of the gain foretold, for a step to be taken
constexpr double kGood = 0.1;             // of it, for the next step to be tried with derivatives at once
constexpr double kSecantBelow = 1e-2;     // relative drop of the cost in one step
constexpr double kOptimality = 1e-5;      // residual of a solution's first-order conditions [standard deviations]
constexpr double kPolishBelow = 1e-9;     // relative change of the merit that may be rounding, multipliers being large
constexpr int kMostPolishing = 5;         // steps that leave more than half of that residual
constexpr double kHardlyLess = 0.9;       // violation after a step over that before it
constexpr int kMostRefused = 10, kOftenRefused = 3;  // steps, more than were taken of late
constexpr int kMostJumps = 5;                        // crossed in a row without the cost falling
constexpr double kWorthAJump = 1e-3;                 // by this much, relative

/// The loop of damped steps, of whichever model.
class DampedSteps {
 public:
  DampedSteps(Program& program, Session& session, SoftModel& model, const LevenbergMarquardtOptions& options)
      : options_(options), program_(program), session_(session), model_(model), damping_(fresh_damping()) {}

  void run() {
    auto& s = session_.summary;
    if (!session_.start(program_, [this] { return model_.linearize(); })) return;
    model_.begin();
    while (!session_.ended()) {
      if (options_.progress)
        session_.report(s.iterations, s.cost, s.iterations ? model_.step().norm() : 0.0, model_.violation().size);
      if (session_.should_stop()) break;
      if (s.iterations >= options_.max_iterations) {
        session_.end(Status::max_iterations);
        break;
      }
      if (const std::string bad = model_.not_finite(); !bad.empty()) {
        session_.end(Status::failed, "a Jacobian is not finite, in " + bad);
        break;
      }
      if (model_.gradient_size() <= options_.gradient_tolerance * std::sqrt(1 + s.cost) && model_.feasible()) {
        model_.estimate_multipliers();
        if (optimal()) {
          session_.end(Status::converged, "the gradient vanished");
          break;
        }
        model_.take_multipliers();  // they pushed against bounds that X̄ does not touch
      }
      ++s.iterations;
      model_.choose_hessian(damping_.value > kStrongDamping, free());
      if (!try_step() && damping_.value > kUselessDamping) end_when_nothing_is_left();
    }
    if (s.status != Status::converged) model_.restore_best();
    if (s.cost > before_jump_) {  // what lies beyond is worse
      model_.restore();
      if (s.status == Status::converged || s.status == Status::failed) {
        s.status = Status::failed;
        s.message = at_jump_;
      }
    }
    if (!at_jump_.empty() && model_.constrained() && s.status == Status::converged &&
        model_.best_cost() < s.cost * (1 - kWorthAJump)) {
      model_.restore_best();
      s.status = Status::failed;
      s.message = at_jump_;
    }
    if (s.status == Status::converged) model_.leave_multipliers();
    const Workspace work = model_.workspace();
    session_.conclude(program_, kConstraintTolerance, &work);
  }

 private:
  Damping fresh_damping() const { return {options_.initial_damping, kNoDamping, 1e-12, 4, 2}; }
  double free_damping() const { return std::max(options_.initial_damping, kFreeDamping); }
  /// Whether it is not the damping that makes steps small.
  bool free() const { return damping_.value <= free_damping(); }
  bool optimal() { return model_.optimality() <= kOptimality; }

  bool refuse() {
    program_.reset();
    damping_.refuse();
    refused_ = std::min(refused_ + 1, kMostRefused);
    if (refused_ >= kOftenRefused && model_.relax_penalty()) refused_ = 0;
    model_.forget_curvature();
    last_step_good_ = false;
    return false;
  }

  /// One trial step; false when it is refused.
  bool try_step() {
    auto& s = session_.summary;
    while (!model_.find_step(damping_.value)) {
      if (model_.lessen_curvature()) continue;  // rather than damp what curves downwards
      refuse();
      if (damping_.value > kUselessDamping || session_.should_stop()) return false;
    }
    const double merit = model_.merit(), predicted = model_.predicted();
    double trial = model_.merit_at_step(last_step_good_);
    if (predicted <= kRounding * merit) return rest(merit, trial);  // at a solution, or damped until nothing moves
    double ratio = (merit - trial) / predicted;
    const double least = options_.cost_tolerance * s.cost;
    if (!(ratio > kAccepted)) {
      if (free() && model_.feasible()) {
        model_.estimate_multipliers_at_step();
        if (predicted <= least && optimal()) {
          session_.end(Status::converged, "the cost changes no more");
          return true;
        }
      }
      if (merit_is_blind(merit, trial)) return polish();
      trial = model_.merit_at_corrected_step(damping_.value);
      ratio = (merit - trial) / predicted;
      if (!(ratio > kAccepted)) {
        model_.drop_correction();
        return refuse();
      }
    }
    const double drop = merit - trial, violation_before = model_.violation().size;
    model_.estimate_multipliers_at_step();
    if (!model_.move_on()) return refuse();
    polished_ = 0;
    if (free() && model_.feasible()) {
      if (drop <= least && predicted <= least && optimal()) {
        session_.end(Status::converged, "the cost changes no more");
      } else if (model_.step_size() <= options_.step_tolerance && optimal()) {
        session_.end(Status::converged, "the steps have become too small to matter");
      }
    }
    // Far away, where the cost still falls fast, the curvature of one place says little about the next.
    if (drop <= kSecantBelow * s.cost) model_.learn();
    last_step_good_ = ratio > kGood;
    damping_.accept(ratio);
    refused_ = std::max(refused_ - 1, 0);
    model_.update_multipliers(ratio);
    update_penalty(model_.violation().size > kHardlyLess * violation_before && damping_.value <= kStrongDamping);
    return true;
  }

  /// The model foretells no gain but rounding.
  bool rest(double merit, double trial) {
    // The weights are so large that the factor has lost the step.
    if (model_.predicted() < -kPolishBelow * merit) return refuse();
    if (model_.feasible()) {
      if (model_.constrained() && std::isfinite(trial)) return polish();
      if (trial <= merit) model_.move();
      end_when_nothing_is_left();
      return true;
    }
    if (!free()) return refuse();
    program_.reset();
    model_.estimate_multipliers();
    model_.take_multipliers();
    update_penalty(true);
    return true;
  }

  /// Whether the merit no longer tells steps apart.
  bool merit_is_blind(double merit, double trial) const {
    const double rounding = kPolishBelow * merit;
    return model_.constrained() && free() && model_.predicted() <= rounding && trial - merit <= rounding;
  }

  /// Where it does not tell, they are taken while the residual of the optimality conditions falls.
  bool polish() {
    model_.estimate_multipliers_at_step();
    const double before = model_.optimality();
    if (!model_.move_on()) return refuse();
    const double after = model_.optimality();
    if (model_.feasible() && after <= kOptimality) {
      session_.end(Status::converged, "no step lowers the cost any further");
    } else if (after > 0.5 * before && ++polished_ > kMostPolishing) {
      end_when_nothing_is_left();
    } else {
      model_.take_multipliers();
    }
    return true;
  }

  /// The same by free steps, where damped ones were refused for rounding: whether they end at a solution.
  bool last_polish() {
    for (int step = 0; step < kMostPolishing; ++step) {
      while (!model_.find_step(free_damping()))
        if (!model_.lessen_curvature()) return false;
      const double merit = model_.merit(), rounding = kPolishBelow * merit;
      if (std::abs(model_.predicted()) > rounding || !(model_.merit_at_step(true) - merit <= rounding)) return false;
      model_.estimate_multipliers_at_step();
      if (!model_.move_on()) return false;
      if (model_.feasible() && optimal()) {
        session_.end(Status::converged, "no step lowers the cost any further");
        return true;
      }
      model_.take_multipliers();
    }
    return false;
  }

  /// At X̄, by Gauss and Newton's Hessian alone; false, and the solve has failed, where that is not defined.
  bool linearize_plainly() {
    program_.reset();
    model_.forget_curvature();
    try {
      model_.linearize();
      return true;
    } catch (const Error& e) {
      session_.end(Status::failed, std::string("a residual's derivatives are undefined: ") + e.what());
      return false;
    }
  }

  void update_penalty(bool no_closer) {
    if (model_.update_penalty(no_closer)) end_infeasible();
  }

  void end_infeasible() {
    session_.end(Status::infeasible, "no small step brings the hard constraints closer together; the worst is " +
                                         program_.describe_row(model_.violation().row));
  }

  /// Converged when a Gauss-Newton step would gain nothing either, failed when it would.
  void end_when_nothing_is_left() {
    if (!linearize_plainly()) return;
    if (model_.locally_infeasible()) return end_infeasible();
    if (model_.constrained() && (last_polish() || !linearize_plainly())) return;
    const double least = std::max(options_.cost_tolerance, kRounding) * session_.summary.cost;
    std::string message = "no step lowers the cost, however short";
    if (model_.constrained()) message = "no step brings the optimality conditions closer";
    const bool gains_nothing = model_.find_step(free_damping()) && model_.predicted() <= least;
    if (!model_.feasible()) {
      message = "no step brings the optimum closer while a hard constraint is violated, worst " +
                program_.describe_row(model_.violation().row);
    } else if (gains_nothing) {
      model_.estimate_multipliers_at_step();
      if (optimal()) return session_.end(Status::converged, "no step lowers the cost any further");
    }
    const Program::Doubt doubt = program_.doubt(model_.step());
    message += because(doubt);
    if (doubt.kind != Program::Doubt::Kind::jump || !cross_jump(message)) session_.end(Status::failed, message);
  }

  /// Where a residual jumps, as that of a rotation does at π, short steps may all cost more while what lies beyond costs
  /// less: a long step, whatever it costs, and at each attempt a shorter one. The best point before is kept, under hard
  /// constraints by the model.
  bool cross_jump(const std::string& message) {
    const double cost = session_.summary.cost;
    if (cost < least_at_jump_ * (1 - kWorthAJump)) jumps_ = 0;
    least_at_jump_ = std::min(least_at_jump_, cost);
    if (!model_.constrained())
      keep_before_jump(message);
    else if (at_jump_.empty())
      at_jump_ = message;
    if (++jumps_ > kMostJumps) return false;
    double damping = free_damping();  // the longest step of all, at first
    for (int i = 1; i < jumps_; ++i) damping *= 10;
    if (!model_.find_step(damping) || !std::isfinite(model_.merit_at_step(true)) || !model_.move_on()) return false;
    damping_ = fresh_damping();
    model_.begin_afresh();
    refused_ = 0;
    last_step_good_ = false;
    return true;
  }

  void keep_before_jump(const std::string& message) {
    if (session_.summary.cost >= before_jump_) return;
    before_jump_ = session_.summary.cost;
    at_jump_ = message;
    program_.keep();
  }

  const LevenbergMarquardtOptions& options_;
  Program& program_;
  Session& session_;
  SoftModel& model_;
  Damping damping_;
  bool last_step_good_ = true;
  int polished_ = 0;
  int refused_ = 0;  // steps, less those that were taken since
  int jumps_ = 0;
  double least_at_jump_ = std::numeric_limits<double>::infinity();  // the least cost at which one was crossed
  double before_jump_ = std::numeric_limits<double>::infinity();    // the same, of the point the program keeps: no rows
  std::string at_jump_;                                             // what there is to say there
};

}  // namespace

struct LevenbergMarquardt::Parts {
  Parts(Problem& problem, const char* solver, const LevenbergMarquardtOptions& given)
      : options(given), session(solver, given), program(problem, SoftBounds::as_rows, in_order_of_elimination) {
    program.use_threads(given.threads);
    if (program.num_rows() > 0) {
      model = std::make_unique<AugmentedModel>(program, session, options, 0.0);
    } else {
      model = std::make_unique<SoftModel>(program, session, options);
    }
  }

  const LevenbergMarquardtOptions& options;
  Session session;
  Program program;
  std::unique_ptr<SoftModel> model;
  bool used = false;
};

LevenbergMarquardt::LevenbergMarquardt(Problem& problem, const char* solver, const LevenbergMarquardtOptions& options)
    : parts_(std::make_unique<Parts>(problem, solver, options)) {}
LevenbergMarquardt::~LevenbergMarquardt() = default;

bool LevenbergMarquardt::is_current() const { return parts_->program.is_current(); }

Summary LevenbergMarquardt::solve(double penalty) {
  if (std::exchange(parts_->used, true)) parts_->session.restart();  // the analysis is of the first solve's time
  parts_->program.use_threads(parts_->options.threads);
  parts_->program.reset();
  parts_->model->restart(penalty);
  DampedSteps(parts_->program, parts_->session, *parts_->model, parts_->options).run();
  return parts_->session.summary;
}

void check(const char* solver, const LevenbergMarquardtOptions& options) {
  if (!(options.cost_tolerance >= 0) || !(options.gradient_tolerance >= 0) || !(options.step_tolerance >= 0) ||
      !(options.initial_damping >= 0) || options.secant_pairs < 0)
    throw Error(std::string(solver) + ": tolerances, initial_damping and secant_pairs must not be negative");
}

}  // namespace tandem::detail
