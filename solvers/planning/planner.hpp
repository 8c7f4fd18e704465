#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tandem/problem/planning/plan_problem.hpp>
#include <tandem/problem/planning/pursuit.hpp>
#include <tandem/problem/program.hpp>
#include <tandem/solvers/planning/damped_sqp.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem {

/// What solves plans: all solve the same program. NLopt's SLSQP is there to compare with, alone (without DampedSqp); it
/// keeps dense matrices.
enum class PlanSolver { augmented_lagrangian, ipopt, slsqp };
/// "augmented-lagrangian", "ipopt", "nlopt:slsqp".
std::string_view name(PlanSolver solver);

struct PlannerOptions {
  PlanSolver solver = PlanSolver::ipopt;
  bool refine = true;  ///< DampedSqp tries first, which takes milliseconds
  double deadline =
      std::numeric_limits<double>::infinity();  ///< s for a plan, after which the best feasible one counts
  int max_iterations = 300;                     ///< of the solver
  int max_warm_iterations = 60;  ///< the same for a plan that has one before it, which there is to fall back on
  int max_warm_refinements =
      25;  ///< of DampedSqp, likewise: then a feasible iterate counts, or the plan before, shifted once; and of any coupled
           ///< one, which has the plan against the prediction to fall back on
  PursuitOptions pursuit{};  ///< the roll-out that a first plan starts from
};

/// A hard constraint may be violated by this much in a plan that is accepted, in its own units.
inline constexpr double kPlanTolerance = 1e-6;

/// A row of a hard inequality that a plan is at the bound of.
struct ActiveConstraint {
  std::string constraint;  ///< residual and variables
  double value, bound;
  double multiplier;  ///< what moving the bound outwards by a unit would save of the cost
};

/// How a plan came about.
enum class PlanOrigin {
  solved,   ///< the solver converged
  stopped,  ///< it was stopped at a feasible point: deadline or iterations
  shifted,  ///< it found nothing feasible; this is the last plan, a step later and from where the chaser is now
};
std::string_view name(PlanOrigin origin);

/// Whether a plan that came about like this, by a solve that ended like that, is one to go by. What no solver took is not,
/// unless it is the last plan, shifted.
inline bool accepted(PlanOrigin origin, Status status, double max_violation) {
  return max_violation <= kPlanTolerance && (origin == PlanOrigin::shifted || status != Status::unsupported);
}

template <int N>
struct PlanResult {
  Plan<N> plan;
  PlanOrigin origin;
  double max_violation;          ///< of the hard constraints, at this plan
  std::string worst_constraint;  ///< the one, when it is above kPlanTolerance
  Summary summary;               ///< of the solve
  bool coupled = false;          ///< with the target's estimate in the program
  bool accepted() const { return tandem::accepted(origin, summary.status, max_violation); }
};

/// Plans again and again, each time from the plan before, shifted by a step. The vehicle must live as long.
template <int N>
class Planner {
 public:
  /// Throws Error when vehicle or options are impossible, or have too many steps for the solver.
  Planner(const VehicleModel<N>& vehicle, const PlanOptions& plan, const PlannerOptions& options = {});

  /// The next plan: `target` has H + 1 instants. A first one starts from a roll-out of pure pursuit. When the solve ends
  /// infeasible, the last plan that was accepted is shifted by the steps since; without one the solver's best is given.
  PlanResult<N> replan(const VehicleState<N>& start, const Vector<3>& current, const TargetPrediction& target);

  /// The same with the target's estimate in one program: `target` is the prediction that it starts from, `start` has the
  /// estimate's pose. It begins with the plan against the prediction, as above, and is that one where DampedSqp does not go
  /// on from there to the end; unless `refine` is off. The estimate's problem, which must live until the next plan, is not
  /// to be gone on with: it may have the plan in it, and the poses that were tried.
  PlanResult<N> replan(const VehicleState<N>& start, const Vector<3>& current, const TargetPrediction& target,
                       const CoupledEstimate& estimate);

  /// What the next replan() starts from: the last plan, shifted, which goes with the target where that is now predicted to be
  /// elsewhere; or, first of all and where it has been shifted a few times in a row, a roll-out of pure pursuit.
  Plan<N> guess(const VehicleState<N>& start, const Vector<3>& current, const TargetPrediction& target) const {
    return starts_afresh() ? pursuit(start, current, target) : moved_with(target);
  }

  /// The hard inequalities that the last solve's plan is at the bound of, with least-squares multipliers of its
  /// optimality conditions.
  std::vector<ActiveConstraint> active_constraints();

  /// Whether the next replan() has a plan before it.
  bool has_plan() const { return last_.has_value(); }
  void set_deadline(double seconds) { options_.deadline = seconds; }
  /// The next replan() starts as the first did.
  void forget() {
    last_.reset();
    multipliers_.clear();
    shifts_ = in_vain_ = 0;
  }
  /// The last replan's; before it, that of plans which are not coupled.
  PlanProblem<N>& problem() { return coupled_ ? *coupled_ : problem_; }
  const VehicleStep<N>& step() const { return step_; }

 private:
  bool starts_afresh() const;
  Plan<N> moved_with(const TargetPrediction& target) const;
  Plan<N> pursuit(const VehicleState<N>& start, const Vector<3>& current, const TargetPrediction& target) const;
  PlanResult<N> decoupled(const VehicleState<N>& start, const Vector<3>& current, const TargetPrediction& target);
  PlanResult<N> outcome(Summary summary, const VehicleState<N>& start, const Vector<3>& current);
  PlanResult<N> remembered(PlanResult<N> result, const Vector<3>& current, const TargetPrediction& target);
  Summary refine(const Plan<N>& guess, double time_limit);
  Summary globalise(const Plan<N>& guess, double time_limit);
  double violation_at_values(std::string& worst);

  PlannerOptions options_;
  PlanProblem<N> problem_;
  DampedSqp sqp_;
  std::unique_ptr<Program> check_;  ///< of what no solver has seen
  std::unique_ptr<PlanProblem<N>> coupled_;
  VehicleStep<N> step_;
  std::optional<Plan<N>> last_;   ///< shifted to the instant that comes next
  std::vector<SE3> last_target_;  ///< that it was against, likewise
  int shifts_ = 0;                ///< of it, in a row
  int in_vain_ = 0;  ///< plans since the solver behind DampedSqp found none: it is not asked again the next second
  std::vector<Eigen::VectorXd> multipliers_;  ///< likewise, of each step; none where it is not optimal
};

extern template class Planner<3>;
extern template class Planner<8>;

}  // namespace tandem
