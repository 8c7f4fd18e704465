#include <array>
#include <chrono>
#include <cmath>
#include <limits>

#include <tandem/lie/error.hpp>
#include <tandem/problem/program.hpp>
#include <tandem/solvers/augmented_model.hpp>
#include <tandem/solvers/planning/damped_sqp.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {
namespace {

constexpr double kSqpPenalty = 1e7;             // over the cost's stiffness: a step meets the linearised constraints
constexpr std::array kDampings{0.1, 0.3, 1.0};  // of the cost's curvature, in the first steps
constexpr double kLeastDamping = 1.0, kMostDamping = 1e3;  // in later ones, as the violation falls or not
constexpr double kCurvedDamping = 0.1;                  // the least once the constraints' curvature is in the Hessian
constexpr int kCurvatureAfter = 6, kCurvatureKept = 4;  // iterations until then, and until it is evaluated anew
constexpr double kNearby = 1e-3;                        // the violation from which on its multipliers are good
constexpr int kFarAway = 10;                            // iterations after which they have to do
constexpr double kStiffer = 10;                         // factor of the damping of a matrix that is not definite
constexpr double kFalls = 0.1, kHardlyFalls = 0.5;      // of the violation before the step
constexpr double kFaster = 0.5, kSlower = 3.0;          // factors of the damping then
constexpr double kDiverged = 1e3;                       // a violation of nothing that is near a plan

}  // namespace

struct DampedSqp::Analysed {
  explicit Analysed(Problem& problem)
      : session("damped-sqp", options), program(problem), model(program, session, options, kSqpPenalty) {}

  LevenbergMarquardtOptions options;
  detail::Session session;
  Program program;
  detail::AugmentedModel model;
};

DampedSqp::DampedSqp(Problem& problem) : problem_(problem) {}
DampedSqp::~DampedSqp() = default;

Summary DampedSqp::solve(const Options& options) try {
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  if (!analysed_) analysed_ = std::make_unique<Analysed>(problem_);
  Program& program = analysed_->program;
  detail::AugmentedModel& model = analysed_->model;
  Summary& summary = analysed_->session.summary;
  summary = {};
  summary.solver = "damped-sqp";

  program.reset();
  Eigen::VectorXd c(program.num_rows());
  const auto end = [&](Status status, const char* why) {
    summary.status = status;
    summary.message = why;
    summary.max_violation = model.violation().size;
    summary.seconds = seconds();
    return summary;
  };
  // The best point there was, which is a feasible one if any was.
  const auto stopped = [&](Status status, const char* why) {
    end(status, why);
    if (summary.max_violation > options.feasible) {
      model.restore_best();
      program.reset();
      summary.cost = program.cost();
      program.constraints(c);
      summary.max_violation = program.violation(c).size;
    }
    return summary;
  };
  model.restart(kSqpPenalty);
  summary.initial_cost = summary.cost = model.linearize();
  if (!std::isfinite(summary.cost)) return end(Status::failed, "the cost is not finite at the start");
  model.begin();
  double violation = model.violation().size, damping = kLeastDamping;
  int curved = 0;  // the iteration whose curvature the Hessian has
  for (int k = 0; k < options.max_iterations; ++k) {
    if (seconds() > options.time_limit) return stopped(Status::time_limit, "the limit of time was reached");
    ++summary.iterations;
    double damped = std::size_t(k) < kDampings.size() ? kDampings[std::size_t(k)] : damping;
    while (!model.find_step(damped)) {
      if (!curved || damped > kMostDamping)
        return end(Status::failed, "the quadratic program's matrix is not positive definite");
      damped *= kStiffer;
    }
    damping = std::max(damping, damped);
    const double predicted = model.predicted(), before = violation;
    if (!std::isfinite(model.merit_at_step(true)))
      return end(Status::failed, "a residual is undefined after a full step");
    model.estimate_multipliers_at_step();  // before the move, which linearises anew
    if (!model.move_on()) return end(Status::failed, "a residual is undefined after a full step");
    model.take_multipliers();
    violation = model.violation().size;
    // A step that was damped by d foretells some 1/(1 + d) of what there is to gain.
    if (violation <= options.feasible && (1.0 + damped) * predicted <= options.cost_tolerance * (1.0 + summary.cost))
      return end(Status::converged, "a step gains no more than it has to");
    if (k + 1 >= options.patience && violation <= options.feasible)
      return end(Status::max_iterations, "a feasible point, from which steps still gain a little");
    if (violation > kDiverged) return end(Status::failed, "full steps diverge");
    if (violation > kHardlyFalls * std::max(before, options.feasible))
      damping = std::min(kMostDamping, kSlower * damping);
    else if (violation < kFalls * before || violation <= options.feasible)
      damping = std::max(curved ? kCurvedDamping : kLeastDamping, kFaster * damping);
    const int done = k + 1;
    if (done >= (curved ? curved + kCurvatureKept : kCurvatureAfter) && (violation < kNearby || done > kFarAway)) {
      model.add_curvature();
      damping = kCurvedDamping;
      curved = done;
    }
  }
  return stopped(Status::max_iterations, "the limit of iterations was reached");
} catch (const Error& error) {
  Summary summary;
  summary.solver = "damped-sqp";
  summary.cost = summary.max_violation = std::numeric_limits<double>::quiet_NaN();
  summary.status = Status::failed;
  summary.message = error.what();
  return summary;
}

}  // namespace tandem
