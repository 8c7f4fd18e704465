#include <array>
#include <chrono>
#include <cmath>
#include <limits>

#include <tandem/lie/error.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/augmented_model.hpp>
#include <tandem/solvers/replanning/damped_sqp.hpp>
#include <tandem/solvers/replanning/filter.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {
namespace {

constexpr double kSqpPenalty = 1e7;                     // Weight of constraints, relative to the stiffness of the cost.
constexpr std::array kFirstDampings{0.1, 0.3, 1.0};     // First steps; relative to the curvature of the cost.
constexpr double kMinDamping = 1.0, kMaxDamping = 1e3;  // Range of the damping in later steps.
constexpr double kMinCurvedDamping = 0.05;              // Minimum if the curvature of the constraints is used.
constexpr double kMinWarmDamping = 0.01;                // Minimum near a solution, if started from multipliers.
constexpr int kCurvatureAfter = 4, kCurvaturePeriod = 4;  // Iterations before and between evaluations of the curvature.
constexpr double kReliableViolation = 1e-3;               // Violation below which the multipliers are reliable.
constexpr int kMaxCurvatureDelay = 10;                    // Iterations after which multipliers are used in any case.
constexpr double kIndefiniteFactor = 10;                  // Growth of the damping while the Hessian is indefinite.
constexpr double kMaxIndefiniteDamping = 1e8;             // Limit of this damping.
constexpr double kLargeDecrease = 0.1, kSmallDecrease = 0.5;      // Ratio of the violations after and before a step.
constexpr double kDampingDecrease = 0.5, kDampingIncrease = 3.0;  // Factors of the damping for these ratios.
constexpr double kWarmDampingDecrease = 0.1;                      // Factor of the damping near a solution.
constexpr double kMinFraction = 1.0 / 64.0;                       // Minimum fraction of a step.
constexpr double kRestorationTarget = 0.5;     // Ratio of the violations after and before a restoration.
constexpr double kMinRestorationRatio = 1e-4;  // Minimum acceptance ratio of a restoration step.

LevenbergMarquardtOptions without_secants() {
  LevenbergMarquardtOptions options;
  options.secant_pairs = 0;
  return options;
}

}  // namespace

struct DampedSqp::Analysed {
  explicit Analysed(Problem& problem)
      : session("damped-sqp", options),
        nlp(problem, SoftBoundRole::in_cost, in_elimination_order),
        model(nlp, session, options, kSqpPenalty) {
    model.use_inexact_steps();
  }

  LevenbergMarquardtOptions options = without_secants();
  detail::Session session;
  NlpEvaluator nlp;
  detail::AugmentedModel model;
  detail::Filter filter;
  Eigen::VectorXd step;  ///< a full step
};

class DampedSqp::Loop {
 public:
  using Instant = std::chrono::steady_clock::time_point;

  Loop(Analysed& analysed, const Options& options, Instant start)
      : options_(options),
        nlp_(analysed.nlp),
        model_(analysed.model),
        filter_(analysed.filter),
        summary_(analysed.session.summary),
        step_(analysed.step),
        start_(start) {}

  Summary run();

 private:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  bool stopped() const { return options_.stop && options_.stop->load(std::memory_order_relaxed); }
  bool feasible() const { return model_.meets(options_.feasible); }
  detail::Filter::Point here() const { return {model_.progress().cost, model_.progress().violation}; }

  Summary end(Status status, std::string why);
  void reduce_damping(double& damping, double violation) const;
  void set_violation(const NlpEvaluator::Violation& worst, bool met);
  Summary end_at_best(Status status, const char* why);
  Summary end_stalled();
  bool find_step(double& damped);
  double search(double damped);
  bool accepts(const detail::Filter::Point& from, double fraction, double slope, bool with_derivatives);
  bool restore();
  bool restoring_step(double& damping);

  const Options& options_;
  NlpEvaluator& nlp_;
  detail::AugmentedModel& model_;
  detail::Filter& filter_;
  Summary& summary_;
  Eigen::VectorXd& step_;
  Instant start_;
  int curvature_iteration_ = 0;  // iteration of the last evaluation of the curvature
  bool begun_ = false;
};

Summary DampedSqp::Loop::end(Status status, std::string why) {
  summary_.status = status;
  summary_.message = std::move(why);
  if (begun_) model_.store_multipliers();
  set_violation(model_.violation(), !begun_ || feasible());
  summary_.seconds = seconds();
  return summary_;
}

void DampedSqp::Loop::set_violation(const NlpEvaluator::Violation& worst, bool met) {
  summary_.max_violation = worst.size;
  summary_.worst_constraint = met ? std::string() : nlp_.describe_row(worst.row);
}

/// Ends at the best point so far, which is feasible if any point was.
Summary DampedSqp::Loop::end_at_best(Status status, const char* why) {
  end(status, why);
  if (!summary_.worst_constraint.empty()) {
    model_.restore_best();
    nlp_.reset();
    summary_.cost = nlp_.cost();
    Eigen::VectorXd c(nlp_.num_rows());
    nlp_.constraints(c);
    set_violation(nlp_.violation(c), detail::violated_row(nlp_, c, options_.feasible) < 0);
  }
  return summary_;
}

Summary DampedSqp::Loop::end_stalled() {
  const std::string worst = nlp_.describe_row(model_.violation().row);
  if (!model_.locally_infeasible())
    return end(Status::failed, "no step reduces the violation of the hard constraints; the worst is " + worst);
  return end(Status::infeasible, "no small step reduces the violation of the hard constraints; the worst is " + worst);
}

bool DampedSqp::Loop::find_step(double& damped) {
  while (!model_.find_step(damped)) {
    if (model_.reduce_curvature()) {
      if (!model_.has_curvature()) damped = std::max(damped, kMinDamping);
      continue;
    }
    if (damped > kMaxIndefiniteDamping) return false;
    damped *= kIndefiniteFactor;
  }
  return true;
}

bool DampedSqp::Loop::accepts(const detail::Filter::Point& from, double fraction, double slope, bool with_derivatives) {
  if (!std::isfinite(model_.merit_at_step(with_derivatives))) return false;
  const auto [cost, violation] = model_.progress_at_step();
  return filter_.accept(from, {cost, violation}, fraction, slope);
}

/// Moves by a fraction of the step, and returns it: the largest one of 1, ½, ¼, … that the filter accepts, or 0. Near a
/// solution, a second-order correction of a rejected full step comes first. Curved rows increase the cost in a way that
/// the curvature of the Lagrangian does not predict (Maratos 1978).
double DampedSqp::Loop::search(double damped) {
  const double slope = model_.cost_slope();
  const detail::Filter::Point from = here();  // a correction changes the rows of the model
  step_ = model_.step();
  model_.estimate_multipliers_at_step();  // before the move, which linearises again
  if (accepts(from, 1.0, slope, true)) return model_.move_on() ? 1.0 : 0.0;
  if (model_.violation().size < kReliableViolation) {
    const double merit = model_.merit_at_corrected_step(damped);
    const auto [cost, violation] = model_.progress_at_step();
    if (std::isfinite(merit) && filter_.accept(from, {cost, violation}, 1.0, slope))
      return model_.move_on() ? 1.0 : 0.0;
    model_.drop_correction();
  }
  for (double fraction = 0.5; fraction >= kMinFraction; fraction *= 0.5) {
    model_.set_step(fraction * step_);
    if (accepts(from, fraction, slope, false)) return model_.move_on() ? fraction : 0.0;
  }
  nlp_.reset();
  return 0.0;
}

void DampedSqp::Loop::reduce_damping(double& damping, double violation) const {
  if (options_.from_multipliers && violation < kReliableViolation)
    damping = std::max(kMinWarmDamping, kWarmDampingDecrease * damping);
  else
    damping = std::max(model_.has_curvature() ? kMinCurvedDamping : kMinDamping, kDampingDecrease * damping);
}

/// Takes one Levenberg–Marquardt step on the violation.
bool DampedSqp::Loop::restoring_step(double& damping) {
  for (; damping <= kSqpPenalty * kMaxIndefiniteDamping; damping *= kIndefiniteFactor) {
    if (!model_.find_step(damping)) continue;
    const double gain = model_.merit() - model_.merit_at_step(false);
    if (!(gain > kMinRestorationRatio * model_.predicted())) continue;
    damping = std::max(kMinDamping, damping / kIndefiniteFactor);
    return model_.move_on();
  }
  nlp_.reset();
  return false;
}

/// Reduces the violation regardless of the cost, for use if the filter accepts no step (Wächter & Biegler 2006, §3.3).
/// Returns false if this fails.
bool DampedSqp::Loop::restore() {
  const detail::Filter::Point from = here();
  filter_.add(from);
  model_.drop_multipliers();
  for (double damping = kMaxDamping;
       summary_.iterations < options_.max_iterations && seconds() < options_.time_limit && !stopped();) {
    ++summary_.iterations;
    if (!restoring_step(damping)) return false;
    const detail::Filter::Point to = here();
    if (feasible() || (to.violation <= kRestorationTarget * from.violation && filter_.admits(to))) return true;
    if (model_.locally_infeasible()) return false;
  }
  return true;
}

Summary DampedSqp::Loop::run() {
  summary_ = {};
  summary_.solver = "damped-sqp";
  nlp_.reset();
  model_.restart(kSqpPenalty);
  summary_.initial_cost = summary_.cost = model_.linearize();
  if (!std::isfinite(summary_.cost)) return end(Status::failed, "the cost is not finite at the initial guess");
  model_.begin();
  begun_ = true;
  filter_.start(here().violation);
  if (options_.from_multipliers) {
    model_.add_curvature();
    curvature_iteration_ = 1;
  }
  double damping = curvature_iteration_ ? kMinCurvedDamping : kMinDamping;
  bool rejected = false;
  double moved = 0;  // norm of the last step
  while (summary_.iterations < options_.max_iterations) {
    const int k = summary_.iterations;
    if (options_.progress) options_.progress({k, summary_.cost, moved, model_.violation().size, seconds()});
    if (stopped()) return end_at_best(Status::interrupted, sentence(Status::interrupted).data());
    ++summary_.iterations;
    if (seconds() > options_.time_limit) return end_at_best(Status::time_limit, "the time limit was reached");
    const bool first_steps = !rejected && !options_.from_multipliers && std::size_t(k) < kFirstDampings.size();
    double damped = first_steps ? kFirstDampings[std::size_t(k)] : damping;
    if (!find_step(damped)) return end(Status::failed, "the Hessian of the quadratic program is not positive definite");
    damping = std::max(damping, damped);
    const double predicted = model_.predicted(), before = model_.violation().size, cost = summary_.cost;
    const double fraction = search(damped);
    rejected = rejected || fraction < 1.0;
    moved = fraction * step_.norm();
    if (fraction == 0.0) {
      if (damping < kMaxDamping) {
        damping *= kIndefiniteFactor;
      } else if (feasible()) {
        return end(Status::failed, "no step lowers the cost");
      } else if (!restore()) {
        return end_stalled();
      }
      continue;
    }
    model_.accept_multipliers();
    const double violation = model_.violation().size;
    // A step with damping d gains about 1/(1 + d) of the possible gain. After a Newton step near a solution, less
    // remains than it gained.
    const double tolerance = options_.cost_tolerance * (1.0 + summary_.cost);
    const bool newton =
        model_.has_curvature() && damped <= kMinCurvedDamping && fraction == 1.0 && before < kReliableViolation;
    if (feasible() &&
        ((1.0 + damped) * predicted <= tolerance || (newton && std::abs(cost - summary_.cost) <= tolerance)))
      return end(Status::converged, "the predicted gain of a step is below the tolerance");
    if (k + 1 >= options_.patience && feasible())
      return end(Status::max_iterations, "ended at a feasible point before convergence");
    if (fraction < 1.0)
      damping = std::min(kMaxDamping, kDampingIncrease * damping);
    else if (violation > kSmallDecrease * std::max(before, options_.feasible))
      damping = std::min(kMaxDamping, kDampingIncrease * damping);
    else if (violation < kLargeDecrease * before || feasible())
      reduce_damping(damping, violation);
    const int done = k + 1;
    if (done >= (curvature_iteration_ ? curvature_iteration_ + kCurvaturePeriod : kCurvatureAfter) &&
        (violation < kReliableViolation || done > kMaxCurvatureDelay)) {
      model_.add_curvature();
      damping = kMinCurvedDamping;
      curvature_iteration_ = done;
    }
  }
  return end_at_best(Status::max_iterations, "the iteration limit was reached");
}

DampedSqp::DampedSqp(Problem& problem) : problem_(problem) {}
DampedSqp::~DampedSqp() = default;

Summary DampedSqp::solve(const Options& options) try {
  const Loop::Instant start = std::chrono::steady_clock::now();
  if (!analysed_) analysed_ = std::make_unique<Analysed>(problem_);
  analysed_->options.from_multipliers = options.from_multipliers;
  return Loop(*analysed_, options, start).run();
} catch (const UndefinedResidualError& error) {
  Summary summary;
  summary.solver = "damped-sqp";
  summary.cost = summary.max_violation = std::numeric_limits<double>::quiet_NaN();
  summary.status = Status::failed;
  summary.message = error.what();
  return summary;
}

}  // namespace tandem
