#include <algorithm>
#include <chrono>
#include <cmath>

#include <Eigen/Cholesky>

#include <tandem/lie/error.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/nlopt.hpp>
#include <tandem/solvers/replanning/planner.hpp>

namespace tandem {
namespace {

/// Weight of the constraints, over the stiffness of the cost. It is large because a plan's cost leaves many unknowns
/// soft, while its constraints are stiff.
constexpr double kPlanPenalty = 1e7;
// Factor of the time at which a plan follows the target fully: 2 means at half of its duration.
constexpr double kFollowRate = 2.0;
constexpr double kFollowDistance = 5.0;  // [m]; within this distance of the target, a plan follows it fully.
constexpr int kMaxShifts = 3;            // Number of shifts before each fresh start from a roll-out.
constexpr int kPursuitCorrections = 2;   // Corrections of a roll-out's command for the velocity that it reaches.
// Tolerance on the predicted decrease of the cost, and iterations, of DampedSqp from a roll-out. DampedSqp ends at the
// same local minimum from slightly different starts; an interior-point method often does not.
constexpr double kFirstCostTolerance = 1e-6;
constexpr int kFirstIterations = 150;
constexpr double kActive = 1e-6;  // distance from its bound, relative to 1 + |bound|, at which a row is active

/// Returns options for DampedSqp. `share` is the weight of the plan in the cost.
DampedSqp::Options refinement(double time_limit, double share) {
  DampedSqp::Options options;
  options.time_limit = time_limit;
  options.feasible = 0.9 * kPlanTolerance;
  options.cost_tolerance = 1e-4 * share;
  return options;
}

}  // namespace

std::string_view name(PlanSolver solver) {
  constexpr std::string_view names[] = {"augmented-lagrangian", "ipopt", "nlopt:slsqp"};
  return names[int(solver)];
}

std::string_view name(PlanOrigin origin) {
  constexpr std::string_view names[] = {"solved", "stopped", "shifted"};
  return names[int(origin)];
}

template <int N>
Planner<N>::Planner(const VehicleModel<N>& vehicle, const PlanOptions& plan, const PlannerOptions& options)
    : options_(options), problem_(vehicle, plan), sqp_(problem_.problem()), step_(vehicle, plan.dt) {
  set_deadline(options.deadline);
  if (options.solver != PlanSolver::slsqp) return;
  options_.refine = false;
  const int unknowns = NlpEvaluator(problem_.problem()).num_unknowns();
  if (unknowns > kMaxDenseUnknowns)
    throw BadInputError("a plan of " + std::to_string(plan.steps) + " steps has " + std::to_string(unknowns) +
                        " unknowns, but nlopt:slsqp supports " + std::to_string(kMaxDenseUnknowns) + ": use at most " +
                        std::to_string(plan.steps * kMaxDenseUnknowns / unknowns) +
                        " steps, or ipopt or augmented-lagrangian");
}

template <int N>
void Planner<N>::set_deadline(double seconds) {
  if (!(seconds >= 0)) throw BadInputError("the deadline of a plan must not be negative or NaN");
  options_.deadline = seconds;
}

template <int N>
Plan<N> Planner<N>::pursuit(const VehicleState<N>& start, const Vector<3>& current,
                            const TargetPrediction& target) const {
  const VehicleModel<N>& vehicle = problem_.vehicle();
  const PlanOptions& o = problem_.options();
  const Matrix<6, 6> to_goal = o.goal.inverse().Ad();
  Plan<N> plan{{start}, {}};
  for (std::size_t k = 0; k + 1 < target.pose.size(); ++k) {
    const VehicleState<N> state = plan.states.back();
    const SE3 goal = target.pose[k] * o.goal;
    const Vector<6> goal_twist = to_goal * target.twist[k];
    const auto move = [&](const Vector<N>& command) { return step_.or_constant_twist(state, command, current); };
    if (!is_holonomic(vehicle)) {
      plan.commands.push_back(pursue(vehicle, state, current, goal, goal_twist, options_.pursuit));
      plan.states.push_back(move(plan.commands.back()));
      continue;
    }
    // The drag of a hovering vehicle brakes it within a step, so the command accounts for the whole step. Thrusters at
    // their bounds reach another velocity; its moments need another command.
    const Vector<6> wanted = pursuit_twist(vehicle, state, goal, goal_twist, options_.pursuit);
    Vector<6> next = state.twist + std::min(1.0, o.dt / options_.pursuit.response) * (wanted - state.twist);
    if (o.twist) next = next.cwiseMax(o.twist->lower).cwiseMin(o.twist->upper);
    Vector<N> command = command_reaching(vehicle, o.dt, state, current, next);
    VehicleState<N> end = move(command);
    for (int correction = 0; correction < kPursuitCorrections; ++correction) {
      next.template head<3>() = end.twist.template head<3>();
      command = command_reaching(vehicle, o.dt, state, current, next);
      end = move(command);
    }
    plan.commands.push_back(command);
    plan.states.push_back(end);
  }
  return plan;
}

template <int N>
bool Planner<N>::starts_from_pursuit() const {
  return !last_ || (shifts_ > 0 && shifts_ % kMaxShifts == 0);
}

/// Moves the last plan with the target. The share of the target's motion grows from 0 at the start, where the chaser
/// is, and decreases with the distance: far away, the target's rotation does not matter.
template <int N>
Plan<N> Planner<N>::moved_with(const TargetPrediction& target) const {
  Plan<N> plan = *last_;
  const std::size_t steps = plan.commands.size();
  for (std::size_t k = 1; k < std::min(plan.states.size(), target.pose.size()); ++k) {
    SE3& pose = plan.states[k].pose;
    const SE3 with_target = target.pose[k] * (last_target_[k].inverse() * pose);
    const double distance = (pose.translation() - last_target_[k].translation()).norm();
    const double share =
        std::min(1.0, kFollowRate * double(k) / double(steps)) * std::min(1.0, kFollowDistance / distance);
    pose = pose * SE3::Exp(Vector<6>(share * (pose.inverse() * with_target).Log()));
  }
  return plan;
}

template <int N>
Summary Planner<N>::refine(const Plan<N>& guess, double time_limit) {
  problem_.set_guess(guess);
  DampedSqp::Options options = refinement(time_limit, 1.0);
  if (starts_from_pursuit()) {
    options.cost_tolerance = kFirstCostTolerance;
    options.max_iterations = options.patience = std::min(kFirstIterations, options_.max_iterations);
  } else {
    options.max_iterations = options_.max_warm_refinements;
  }
  options.from_multipliers = !multipliers_.empty();
  if (options.from_multipliers) problem_.set_multipliers(multipliers_);
  return sqp_.solve(options);
}

template <int N>
Summary Planner<N>::solve_globally(const Plan<N>& guess, double time_limit) {
  problem().set_guess(guess);
  const int iterations = starts_from_pursuit() ? options_.max_iterations : options_.max_warm_iterations;
  if (options_.solver == PlanSolver::ipopt) {
    IpoptOptions ipopt;
    ipopt.max_iterations = iterations;
    ipopt.time_limit = time_limit;
    return tandem::solve(problem().problem(), ipopt);
  }
  if (options_.solver == PlanSolver::slsqp) {
    NloptOptions slsqp;
    slsqp.algorithm = "slsqp";
    slsqp.max_iterations = iterations;
    slsqp.time_limit = time_limit;
    return tandem::solve(problem().problem(), slsqp);
  }
  AugmentedLagrangianOptions lagrangian;
  lagrangian.initial_penalty = kPlanPenalty;
  lagrangian.max_iterations = iterations;
  lagrangian.time_limit = time_limit;
  return tandem::solve(problem().problem(), lagrangian);
}

template <int N>
double Planner<N>::violation_at_values(std::string& worst) {
  if (!check_) check_ = std::make_unique<NlpEvaluator>(problem().problem());
  check_->reset();
  Eigen::VectorXd c(check_->num_rows());
  check_->constraints(c);
  const NlpEvaluator::Violation v = check_->violation(c);
  worst = v.size > kPlanTolerance ? check_->describe_row(v.row) : std::string();
  return v.size;
}

template <int N>
PlanResult<N> Planner<N>::replan(const VehicleState<N>& start, const Vector<3>& current,
                                 const TargetPrediction& target) {
  return remember(plan_against_prediction(start, current, target), current, target);
}

template <int N>
PlanResult<N> Planner<N>::plan_against_prediction(const VehicleState<N>& start, const Vector<3>& current,
                                                  const TargetPrediction& target) {
  if (coupled_) check_.reset();
  coupled_.reset();
  problem_.set_start(start, current);
  problem_.set_target(target);
  const Plan<N> from = guess(start, current, target);
  double left = options_.deadline;
  if (options_.refine) {
    const Summary refined = refine(from, left);
    // The solver would not find a feasible plan either, and the last plan is a fallback.
    const bool infeasible = refined.status == Status::infeasible && !starts_from_pursuit();
    const bool ended = refined.converged() || refined.status == Status::time_limit || infeasible;
    if (ended || last_) {
      PlanResult<N> result = make_result(refined, start, current);
      const bool again = result.origin == PlanOrigin::shifted && shifts_ > 0;
      if (ended || (result.accepted() && !again)) return result;
      if (solver_failures_ > 0 && ++solver_failures_ <= kMaxShifts) return result;
    }
    left -= refined.seconds;
  }
  PlanResult<N> result = make_result(solve_globally(from, left), start, current);
  solver_failures_ = result.origin == PlanOrigin::shifted;
  return result;
}

/// Plans against the prediction first: that plan is close to the coupled one, and its solver is analysed already.
template <int N>
PlanResult<N> Planner<N>::replan(const VehicleState<N>& start, const Vector<3>& current, const TargetPrediction& target,
                                 const CoupledEstimate& estimate) {
  const auto begin = std::chrono::steady_clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
  const auto couple = [&] {
    check_.reset();
    coupled_ = std::make_unique<PlanProblem<N>>(problem_.vehicle(), problem_.options(), estimate);
    coupled_->set_start(start, current);
    coupled_->set_target(target);
  };
  if (!options_.refine) {
    couple();
    PlanResult<N> result = remember(
        make_result(solve_globally(guess(start, current, target), options_.deadline - elapsed()), start, current),
        current, target);
    check_.reset();  // refers to the estimate's problem, as below
    return result;
  }
  PlanResult<N> alone = plan_against_prediction(start, current, target);
  if (alone.origin != PlanOrigin::solved || elapsed() >= options_.deadline)
    return remember(std::move(alone), current, target);
  couple();
  coupled_->set_guess(alone.plan);
  coupled_->set_multipliers(problem_.multipliers());
  DampedSqp::Options options = refinement(options_.deadline - elapsed(), estimate.cost_weight);
  options.max_iterations = options_.max_warm_refinements;
  options.from_multipliers = true;
  Summary refined = DampedSqp(coupled_->problem()).solve(options);
  alone.summary.iterations = refined.iterations += alone.summary.iterations;
  alone.summary.seconds = refined.seconds = elapsed();
  if (!refined.converged()) {
    coupled_.reset();
    return remember(std::move(alone), current, target);
  }
  PlanResult<N> result = remember(make_result(refined, start, current), current, target);
  check_.reset();  // refers to the estimate's problem, which may not exist at the next plan
  return result;
}

template <int N>
PlanResult<N> Planner<N>::make_result(Summary summary, const VehicleState<N>& start, const Vector<3>& current) {
  PlanResult<N> result;
  result.summary = std::move(summary);
  result.coupled = coupled_ != nullptr;
  result.plan = problem().plan();
  result.max_violation = result.summary.max_violation;
  result.worst_constraint = result.summary.worst_constraint;
  if (result.summary.status == Status::unsupported) result.max_violation = violation_at_values(result.worst_constraint);
  result.origin = result.summary.converged() ? PlanOrigin::solved : PlanOrigin::stopped;
  if (!result.accepted() && last_) {
    const Plan<N> shifted = last_->from(start, step_, current);
    problem().set_guess(shifted);
    result.plan = shifted;
    result.origin = PlanOrigin::shifted;
    result.max_violation = violation_at_values(result.worst_constraint);
  }
  return result;
}

/// Stores the plan, a step later, for the next replan().
template <int N>
PlanResult<N> Planner<N>::remember(PlanResult<N> result, const Vector<3>& current, const TargetPrediction& target) {
  multipliers_.clear();
  if (!result.accepted() && !last_) return result;
  last_ = result.plan.shifted(step_, current);
  if (result.origin == PlanOrigin::shifted)
    ++shifts_;
  else
    shifts_ = solver_failures_ = 0;
  const auto& poses = target.pose;
  const std::size_t end = poses.size() - 1;
  last_target_.assign(poses.begin() + 1, poses.end());
  last_target_.push_back(poses[end] * (poses[end - 1].inverse() * poses[end]));
  if (result.origin == PlanOrigin::solved && options_.refine) {
    multipliers_ = problem().multipliers();
    multipliers_.push_back(multipliers_.back());
    multipliers_.erase(multipliers_.begin());
  }
  return result;
}

template <int N>
std::vector<ActiveConstraint> Planner<N>::active_constraints() {
  NlpEvaluator nlp(problem().problem());
  const int rows = nlp.num_rows(), unknowns = nlp.num_unknowns();
  Eigen::VectorXd c(rows), gradient(unknowns);
  const auto& pattern = nlp.jacobian_pattern();
  Eigen::VectorXd values(Eigen::Index(pattern.row.size()));
  nlp.gradient(gradient);
  nlp.linearize_constraints(c, values);

  std::vector<int> place(std::size_t(rows), -1), active;
  const auto at = [&](int row, double bound) {
    return std::isfinite(bound) && std::abs(c[row] - bound) <= kActive * (1.0 + std::abs(bound));
  };
  for (int row = 0; row < rows; ++row)
    if (at(row, nlp.lower()[row]) || at(row, nlp.upper()[row])) {
      place[std::size_t(row)] = int(active.size());
      active.push_back(row);
    }
  // Uses only the unknowns that active rows read: in a coupled problem, most belong to the estimate.
  std::vector<int> column(std::size_t(unknowns), -1), read;
  for (std::size_t k = 0; k < pattern.row.size(); ++k)
    if (int& at = column[std::size_t(pattern.column[k])]; at < 0 && place[std::size_t(pattern.row[k])] >= 0) {
      at = int(read.size());
      read.push_back(pattern.column[k]);
    }
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(Eigen::Index(active.size()), Eigen::Index(read.size()));
  for (std::size_t k = 0; k < pattern.row.size(); ++k)
    if (const int row = place[std::size_t(pattern.row[k])]; row >= 0)
      J(row, column[std::size_t(pattern.column[k])]) += values[Eigen::Index(k)];
  // Solves gradient + Jᵀ λ = 0 by least squares. Redundant rows share their multiplier.
  Eigen::MatrixXd normal = J * J.transpose();
  normal.diagonal().array() += 1e-12 * normal.diagonal().maxCoeff();
  const Eigen::VectorXd lambda = normal.ldlt().solve(-(J * gradient(read)));

  std::vector<ActiveConstraint> found;
  for (std::size_t i = 0; i < active.size(); ++i) {
    const int row = active[i];
    const double lower = nlp.lower()[row], upper = nlp.upper()[row];
    if (lower == upper) continue;
    found.push_back({nlp.describe_row(row), c[row], at(row, lower) ? lower : upper,
                     std::abs(lambda[Eigen::Index(i)]) / problem().cost_weight()});
  }
  return found;
}

template class Planner<3>;
template class Planner<8>;

}  // namespace tandem
