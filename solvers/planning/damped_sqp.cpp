#include <array>
#include <chrono>
#include <cmath>
#include <limits>

#include <tandem/lie/error.hpp>
#include <tandem/problem/program.hpp>
#include <tandem/solvers/augmented_model.hpp>
#include <tandem/solvers/planning/damped_sqp.hpp>
#include <tandem/solvers/planning/filter.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {
namespace {

constexpr double kSqpPenalty = 1e7;             // over the cost's stiffness: a step meets the linearised constraints
constexpr std::array kDampings{0.1, 0.3, 1.0};  // of the cost's curvature, in the first steps
constexpr double kLeastDamping = 1.0, kMostDamping = 1e3;  // in later ones, as the violation falls or not
constexpr double kCurvedDamping = 0.05;                 // the least once the constraints' curvature is in the Hessian
constexpr double kNearbyDamping = 0.01;                 // from multipliers, near a solution
constexpr int kCurvatureAfter = 4, kCurvatureKept = 4;  // iterations until then, and until it is evaluated anew
constexpr double kNearby = 1e-3;                        // the violation from which on its multipliers are good
constexpr int kFarAway = 10;                            // iterations after which they have to do
constexpr double kStiffer = 10;                         // factor of the damping of a matrix that is not definite
constexpr double kStiffest = 1e8;                       // which no matrix withstands but by rounding
constexpr double kFalls = 0.1, kHardlyFalls = 0.5;      // of the violation before the step
constexpr double kFaster = 0.5, kSlower = 3.0;          // factors of the damping then
constexpr double kMuchFaster = 0.1;                     // near a solution
constexpr double kShortest = 1.0 / 64.0;                // fraction of a step that is tried
constexpr double kGreatest = 1e4;                       // violation, over the first
constexpr double kRestored = 0.5;                       // of the violation, what a restoration leaves at most
constexpr double kRestores = 1e-4;                      // of what a restoring step foretells, for it to be taken

LevenbergMarquardtOptions without_secants() {
  LevenbergMarquardtOptions options;
  options.secant_pairs = 0;
  return options;
}

}  // namespace

struct DampedSqp::Analysed {
  explicit Analysed(Problem& problem)
      : session("damped-sqp", options),
        program(problem, SoftBounds::in_cost, in_order_of_elimination),
        model(program, session, options, kSqpPenalty) {
    model.use_inexact_steps();
  }

  LevenbergMarquardtOptions options = without_secants();
  detail::Session session;
  Program program;
  detail::AugmentedModel model;
  detail::Filter filter;
  Eigen::VectorXd step;  ///< a whole one
};

/// One solve.
class DampedSqp::Loop {
 public:
  using Instant = std::chrono::steady_clock::time_point;

  Loop(Analysed& analysed, const Options& options, Instant start)
      : options_(options),
        program_(analysed.program),
        model_(analysed.model),
        filter_(analysed.filter),
        summary_(analysed.session.summary),
        step_(analysed.step),
        start_(start) {}

  Summary run();

 private:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  bool feasible() const { return model_.violation().size <= options_.feasible; }
  detail::Filter::Point here() const { return {model_.progress().cost, model_.progress().violation}; }

  Summary end(Status status, std::string why);
  void speed_up(double& damping, double violation) const;
  void violated(const Program::Violation& worst);
  Summary stopped(Status status, const char* why);
  Summary given_up();
  bool find_step(double& damped);
  double search(double damped);
  bool accepts(const detail::Filter::Point& from, double fraction, double slope, bool with_derivatives);
  bool restore();
  bool restoring_step(double& damping);

  const Options& options_;
  Program& program_;
  detail::AugmentedModel& model_;
  detail::Filter& filter_;
  Summary& summary_;
  Eigen::VectorXd& step_;
  Instant start_;
  int curved_ = 0;  // the iteration whose curvature the Hessian has
  bool begun_ = false;
};

Summary DampedSqp::Loop::end(Status status, std::string why) {
  summary_.status = status;
  summary_.message = std::move(why);
  if (begun_) model_.leave_multipliers();
  violated(model_.violation());
  summary_.seconds = seconds();
  return summary_;
}

void DampedSqp::Loop::violated(const Program::Violation& worst) {
  summary_.max_violation = worst.size;
  summary_.worst_constraint = worst.size > options_.feasible ? program_.describe_row(worst.row) : std::string();
}

/// The best point there was, which is a feasible one if any was.
Summary DampedSqp::Loop::stopped(Status status, const char* why) {
  end(status, why);
  if (summary_.max_violation > options_.feasible) {
    model_.restore_best();
    program_.reset();
    summary_.cost = program_.cost();
    Eigen::VectorXd c(program_.num_rows());
    program_.constraints(c);
    violated(program_.violation(c));
  }
  return summary_;
}

Summary DampedSqp::Loop::given_up() {
  const std::string worst = program_.describe_row(model_.violation().row);
  if (!model_.locally_infeasible())
    return end(Status::failed, "no step that was tried lessens the hard constraints' violation, worst " + worst);
  return end(Status::infeasible, "no small step brings the hard constraints closer together; the worst is " + worst);
}

bool DampedSqp::Loop::find_step(double& damped) {
  while (!model_.find_step(damped)) {
    if (model_.lessen_curvature()) {
      if (!model_.has_curvature()) damped = std::max(damped, kLeastDamping);
      continue;
    }
    if (damped > kStiffest) return false;
    damped *= kStiffer;
  }
  return true;
}

bool DampedSqp::Loop::accepts(const detail::Filter::Point& from, double fraction, double slope, bool with_derivatives) {
  if (!std::isfinite(model_.merit_at_step(with_derivatives))) return false;
  const auto [cost, violation] = model_.progress_at_step();
  return filter_.accept(from, {cost, violation}, fraction, slope);
}

/// Goes a fraction of the step that was found, the largest of 1, ½, ¼ … that the filter accepts; 0 where none is. Rows
/// that bend make a whole one cost more than the Lagrangian's curvature foretells, whichever side of them it ends on:
/// near a solution it is corrected first (Maratos 1978).
double DampedSqp::Loop::search(double damped) {
  const double slope = model_.cost_slope();
  const detail::Filter::Point from = here();  // a correction changes the model's rows
  step_ = model_.step();
  model_.estimate_multipliers_at_step();  // before the move, which linearises anew
  if (accepts(from, 1.0, slope, true)) return model_.move_on() ? 1.0 : 0.0;
  if (model_.violation().size < kNearby) {
    const double merit = model_.merit_at_corrected_step(damped);
    const auto [cost, violation] = model_.progress_at_step();
    if (std::isfinite(merit) && filter_.accept(from, {cost, violation}, 1.0, slope))
      return model_.move_on() ? 1.0 : 0.0;
    model_.drop_correction();
  }
  for (double fraction = 0.5; fraction >= kShortest; fraction *= 0.5) {
    model_.set_step(fraction * step_);
    if (accepts(from, fraction, slope, false)) return model_.move_on() ? fraction : 0.0;
  }
  program_.reset();
  return 0.0;
}

void DampedSqp::Loop::speed_up(double& damping, double violation) const {
  if (options_.from_multipliers && violation < kNearby)
    damping = std::max(kNearbyDamping, kMuchFaster * damping);
  else
    damping = std::max(model_.has_curvature() ? kCurvedDamping : kLeastDamping, kFaster * damping);
}

/// One step of Levenberg and Marquardt's on the violation.
bool DampedSqp::Loop::restoring_step(double& damping) {
  for (; damping <= kSqpPenalty * kStiffest; damping *= kStiffer) {
    if (!model_.find_step(damping)) continue;
    const double gain = model_.merit() - model_.merit_at_step(false);
    if (!(gain > kRestores * model_.predicted())) continue;
    damping = std::max(kLeastDamping, damping / kStiffer);
    return model_.move_on();
  }
  program_.reset();
  return false;
}

/// Where no step that the filter accepts is left: less violation, whatever it costs.   Wächter & Biegler 2006, §3.3
bool DampedSqp::Loop::restore() {
  const detail::Filter::Point from = here();
  filter_.leave(from);
  model_.drop_multipliers();
  for (double damping = kMostDamping;
       summary_.iterations < options_.max_iterations && seconds() < options_.time_limit;) {
    ++summary_.iterations;
    if (!restoring_step(damping)) return false;
    const detail::Filter::Point to = here();
    if (feasible() || (to.violation <= kRestored * from.violation && filter_.admits(to))) return true;
    if (model_.locally_infeasible()) return false;
  }
  return true;
}

Summary DampedSqp::Loop::run() {
  summary_ = {};
  summary_.solver = "damped-sqp";
  filter_.clear();
  program_.reset();
  model_.restart(kSqpPenalty);
  summary_.initial_cost = summary_.cost = model_.linearize();
  if (!std::isfinite(summary_.cost)) return end(Status::failed, "the cost is not finite at the start");
  model_.begin();
  begun_ = true;
  filter_.leave({-HUGE_VAL, kGreatest * std::max(1.0, here().violation)});
  if (options_.from_multipliers) {
    model_.add_curvature();
    curved_ = 1;
  }
  double damping = curved_ ? kCurvedDamping : kLeastDamping;
  bool refused = false;
  while (summary_.iterations < options_.max_iterations) {
    const int k = summary_.iterations++;
    if (seconds() > options_.time_limit) return stopped(Status::time_limit, "the limit of time was reached");
    const bool free = !refused && !options_.from_multipliers && std::size_t(k) < kDampings.size();
    double damped = free ? kDampings[std::size_t(k)] : damping;
    if (!find_step(damped)) return end(Status::failed, "the quadratic program's matrix is not positive definite");
    damping = std::max(damping, damped);
    const double predicted = model_.predicted(), before = model_.violation().size, cost = summary_.cost;
    const double fraction = search(damped);
    refused = refused || fraction < 1.0;
    if (fraction == 0.0) {
      if (damping < kMostDamping) {
        damping *= kStiffer;
      } else if (feasible()) {
        return end(Status::failed, "no step lessens the cost");
      } else if (!restore()) {
        return given_up();
      }
      continue;
    }
    model_.take_multipliers();
    const double violation = model_.violation().size;
    // A step that was damped by d foretells some 1/(1 + d) of what there is to gain; after a Newton step near a solution there
    // is less to gain than what it did.
    const double little = options_.cost_tolerance * (1.0 + summary_.cost);
    const bool newton = model_.has_curvature() && damped <= kCurvedDamping && fraction == 1.0 && before < kNearby;
    if (feasible() && ((1.0 + damped) * predicted <= little || (newton && std::abs(cost - summary_.cost) <= little)))
      return end(Status::converged, "a step gains no more than it has to");
    if (k + 1 >= options_.patience && feasible())
      return end(Status::max_iterations, "a feasible point, from which steps still gain a little");
    if (fraction < 1.0)
      damping = std::min(kMostDamping, kSlower * damping);
    else if (violation > kHardlyFalls * std::max(before, options_.feasible))
      damping = std::min(kMostDamping, kSlower * damping);
    else if (violation < kFalls * before || violation <= options_.feasible)
      speed_up(damping, violation);
    const int done = k + 1;
    if (done >= (curved_ ? curved_ + kCurvatureKept : kCurvatureAfter) && (violation < kNearby || done > kFarAway)) {
      model_.add_curvature();
      damping = kCurvedDamping;
      curved_ = done;
    }
  }
  return stopped(Status::max_iterations, "the limit of iterations was reached");
}

DampedSqp::DampedSqp(Problem& problem) : problem_(problem) {}
DampedSqp::~DampedSqp() = default;

Summary DampedSqp::solve(const Options& options) try {
  const Loop::Instant start = std::chrono::steady_clock::now();
  if (!analysed_) analysed_ = std::make_unique<Analysed>(problem_);
  analysed_->options.from_multipliers = options.from_multipliers;
  return Loop(*analysed_, options, start).run();
} catch (const Error& error) {
  Summary summary;
  summary.solver = "damped-sqp";
  summary.cost = summary.max_violation = std::numeric_limits<double>::quiet_NaN();
  summary.status = Status::failed;
  summary.message = error.what();
  return summary;
}

}  // namespace tandem
