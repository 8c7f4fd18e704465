#pragma once

#include <optional>
#include <span>
#include <vector>

#include <tandem/lie/rn.hpp>
#include <tandem/problem/planning/plan_options.hpp>
#include <tandem/problem/problem.hpp>

namespace tandem {

struct CoupledEstimate;

namespace detail {

/// Variables at one instant of a plan. This file has the parts of PlanProblem that do not depend on the number of
/// actuators.
struct PlanStep {
  Variable<SE3> chaser, target;
  Variable<Rn<6>> twist, target_twist;  ///< target_twist: velocity of the goal, which moves with the target
};

/// Negative margins of the constraints on the target after each step [m]; fixed variables.
struct PlanMargins {
  std::vector<Variable<Rn<1>>> keep_out, approach, view;
};

/// Adds TwistKinematics over dt [s] as a hard equality.
Block add_kinematics(Problem& problem, double dt, const PlanStep& from, const PlanStep& to);
/// Adds the motion prior over three target poses, `last` and `dt` [s] apart, with the same noise as predict_target().
void add_target_motion(Problem& problem, const CoupledEstimate& estimate, double last, double dt,
                       const Variable<SE3>& before, const Variable<SE3>& now, const Variable<SE3>& next);
/// Adds the costs of the chaser's state after step `k`, counted from 1, multiplied by `cost_weight`. Returns the fixed
/// gain variable of Visibility if PlanOptions::information is used.
std::optional<Variable<Rn<1>>> add_goal(Problem& problem, const PlanOptions& options, int k, double cost_weight,
                                        const PlanStep& step);
/// Adds the hard constraints on the chaser's state. Appends to `margins` and `hard`.
void add_limits(Problem& problem, const PlanOptions& options, const PlanStep& step, PlanMargins& margins,
                std::vector<Block>& hard);
/// Sets the margins to chance √(J Σ Jᵀ) at the current values. `covariance` has the covariance of the target at
/// each instant, the first one now.
void set_margins(Problem& problem, const PlanOptions& options, std::span<const Variable<SE3>> chaser,
                 std::span<const Variable<SE3>> target, std::span<const Matrix<6, 6>> covariance,
                 const PlanMargins& margins);

}  // namespace detail
}  // namespace tandem
