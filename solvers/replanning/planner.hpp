#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/problem/planning/plan_problem.hpp>
#include <tandem/problem/planning/pursuit.hpp>
#include <tandem/solvers/replanning/damped_sqp.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// Solver of the planning problem. NLopt's SLSQP is meant for comparisons; it runs without DampedSqp and uses dense
/// matrices.
enum class PlanSolver { augmented_lagrangian, ipopt, slsqp };
/// Returns "augmented-lagrangian", "ipopt" or "nlopt:slsqp".
std::string_view name(PlanSolver solver);

struct PlannerOptions {
  PlanSolver solver = PlanSolver::ipopt;
  bool refine = true;                                         ///< Try DampedSqp first, which takes milliseconds.
  double deadline = std::numeric_limits<double>::infinity();  ///< Time limit of a plan [s].
  int max_iterations = 300;                                   ///< Iterations of the solver.
  int max_warm_iterations = 60;                               ///< Iterations if the previous plan is a fallback.
  /// Iterations of DampedSqp if the previous plan is a fallback, and for a coupled plan. Afterwards a feasible iterate
  /// or the fallback is used.
  int max_warm_refinements = 25;
  PursuitOptions pursuit{};  ///< roll-out that is the initial guess of a first plan
};

/// Tolerance on the violation of the hard constraints of an accepted plan, in their own units.
inline constexpr double kPlanTolerance = 1e-6;

/// Row of a hard inequality that is active in a plan.
struct ActiveConstraint {
  std::string constraint;  ///< residual and variables
  double value, bound;
  double multiplier;  ///< decrease of the cost if the bound is relaxed by a unit
};

enum class PlanOrigin {
  solved,   ///< The solver converged.
  stopped,  ///< The solver stopped at a feasible point: deadline or iteration limit.
  /// The solver found no feasible point; this is the last plan, shifted by a step and started from the chaser's present
  /// state.
  shifted,
};
std::string_view name(PlanOrigin origin);

/// Returns whether a plan can be executed. A problem that the solver does not support gives no usable plan, except the
/// shifted last plan.
inline bool accepted(PlanOrigin origin, Status status, double max_violation) {
  return max_violation <= kPlanTolerance && (origin == PlanOrigin::shifted || status != Status::unsupported);
}

template <int N>
struct PlanResult {
  Plan<N> plan;
  PlanOrigin origin;
  double max_violation;          ///< largest violation of the hard constraints by this plan
  std::string worst_constraint;  ///< most violated constraint if above kPlanTolerance
  Summary summary;               ///< result of the last solve
  bool coupled = false;          ///< the target's estimate was part of the problem
  bool accepted() const { return tandem::accepted(origin, summary.status, max_violation); }
};

/// Receding-horizon planner. Each plan starts from the previous one, shifted by a step.
/// Different planners may be used in different threads.
template <int N>
class Planner {
 public:
  /// Copies the vehicle. Throws BadInputError if the vehicle or the options are invalid, or if the plan has too many
  /// steps for the solver.
  Planner(const VehicleModel<N>& vehicle, const PlanOptions& plan, const PlannerOptions& options = {});

  /// Returns the next plan. `target` has H + 1 instants. The initial guess of a first plan is a roll-out of pure
  /// pursuit. If the solver finds no feasible plan, the result is the last accepted plan, shifted; without one, the
  /// best point of the solver.
  PlanResult<N> replan(const VehicleState<N>& start, const Vector<3>& current, const TargetPrediction& target);

  /// Plans with the target's estimate in one problem.
  ///
  /// `target` is the initial guess of the prediction, and the pose of `start` is that of the estimate. The plan against
  /// the prediction comes first. It is the result if DampedSqp does not converge from it on the coupled problem. With
  /// `refine` off, only the coupled problem is solved. The problem of the estimate must exist until the next replan(),
  /// and must not be used further: it may contain the plan and trial poses.
  PlanResult<N> replan(const VehicleState<N>& start, const Vector<3>& current, const TargetPrediction& target,
                       const CoupledEstimate& estimate);

  /// Returns the initial guess of the next replan(): the last plan, shifted and moved with the predicted target. For
  /// the first plan, and after a few consecutive shifts, a roll-out of pure pursuit.
  Plan<N> guess(const VehicleState<N>& start, const Vector<3>& current, const TargetPrediction& target) const {
    return starts_from_pursuit() ? pursuit(start, current, target) : moved_with(target);
  }

  /// Returns the active hard inequalities of the last plan, with least-squares multipliers of the optimality
  /// conditions.
  std::vector<ActiveConstraint> active_constraints();

  /// Returns whether the next replan() starts from a previous plan.
  bool has_plan() const { return last_.has_value(); }
  /// Throws BadInputError if the deadline is negative or NaN.
  void set_deadline(double seconds);
  /// Discards the previous plan.
  void reset() {
    last_.reset();
    multipliers_.clear();
    shifts_ = solver_failures_ = 0;
  }
  /// Returns the problem of the last replan(); before it, the problem without the estimate.
  PlanProblem<N>& problem() { return coupled_ ? *coupled_ : problem_; }
  const VehicleStep<N>& step() const { return step_; }

 private:
  bool starts_from_pursuit() const;
  Plan<N> moved_with(const TargetPrediction& target) const;
  Plan<N> pursuit(const VehicleState<N>& start, const Vector<3>& current, const TargetPrediction& target) const;
  PlanResult<N> plan_against_prediction(const VehicleState<N>& start, const Vector<3>& current,
                                        const TargetPrediction& target);
  PlanResult<N> make_result(Summary summary, const VehicleState<N>& start, const Vector<3>& current);
  PlanResult<N> remember(PlanResult<N> result, const Vector<3>& current, const TargetPrediction& target);
  Summary refine(const Plan<N>& guess, double time_limit);
  Summary solve_globally(const Plan<N>& guess, double time_limit);
  double violation_at_values(std::string& worst);

  PlannerOptions options_;
  PlanProblem<N> problem_;
  DampedSqp sqp_;
  std::unique_ptr<NlpEvaluator> check_;  ///< evaluates plans that no solver has evaluated
  std::unique_ptr<PlanProblem<N>> coupled_;
  VehicleStep<N> step_;
  std::optional<Plan<N>> last_;   ///< Shifted to the next instant.
  std::vector<SE3> last_target_;  ///< Target of the last plan, shifted to the next instant.
  int shifts_ = 0;                ///< Consecutive shifts of the last plan.
  int solver_failures_ = 0;  ///< Plans since the solver behind DampedSqp failed; it is skipped for a few plans then.
  std::vector<Eigen::VectorXd> multipliers_;  ///< Per step, shifted; empty if the last plan is not optimal.
};

extern template class Planner<3>;
extern template class Planner<8>;

}  // namespace tandem
