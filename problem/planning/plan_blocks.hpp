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

/// The parts of a plan's program that do not depend on how many actuators the vehicle has, compiled once.
struct PlanStep {
  Variable<SE3> chaser, target;
  Variable<Rn<6>> twist, target_twist;  ///< the target's as seen from the goal
};

/// Of each constraint on the target, after each step: less the margin [m]; fixed.
struct PlanMargins {
  std::vector<Variable<Rn<1>>> keep_out, approach, view;
};

/// TwistKinematics, over dt seconds.
Block tie_kinematics(Problem& problem, double dt, const PlanStep& from, const PlanStep& to);
/// The motion prior over three poses of the target, the last two dt apart, as predict_target has it, with its noise.
void tie_target(Problem& problem, const CoupledEstimate& estimate, double last, double dt, const Variable<SE3>& before,
                const Variable<SE3>& now, const Variable<SE3>& next);
/// The costs of where the chaser is after step `k`, counted from 1, each for `share`. With PlanOptions::information the
/// gain of Unseen, which is fixed.
std::optional<Variable<Rn<1>>> add_goal(Problem& problem, const PlanOptions& options, int k, double share,
                                        const PlanStep& step);
/// The hard bounds of where the chaser is; adds to `margins` and `hard`.
void add_limits(Problem& problem, const PlanOptions& options, const PlanStep& step, PlanMargins& margins,
                std::vector<Block>& hard);
/// Margins k √(J Σ Jᵀ) at the problem's values; `covariance` of the target at each instant, now first.
void set_margins(Problem& problem, const PlanOptions& options, std::span<const Variable<SE3>> chaser,
                 std::span<const Variable<SE3>> target, std::span<const Matrix<6, 6>> covariance,
                 const PlanMargins& margins);

}  // namespace detail
}  // namespace tandem
