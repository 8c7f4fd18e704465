#pragma once

#include <optional>
#include <string>

#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem {

/// A set of constraints on the target's motion, independent of whether they are hard, soft or off.
struct TargetConstraints {
  bool non_holonomic = false, roll_pitch = false;
  std::optional<Bounds<1>> surge{};      ///< m/s
  std::optional<double> max_yaw_rate{};  ///< rad/s
};

/// Returns the constraints in the options: non-holonomic motion if soft or hard, roll and pitch if hard (soft is the
/// default of every problem), and the limits.
TargetConstraints constraints_of(const TrackingOptions& options);

/// Returns the options with these constraints off, soft or hard.
TrackingOptions with_constraints(TrackingOptions options, const TargetConstraints& constraints, Role role);

/// Describes the constraints, for example "non-holonomic and surge within 0 … 2.5 m/s".
std::string describe(const TargetConstraints& constraints);

/// Violation of constraints by the target's consecutive poses.
struct ConstraintCheck {
  double violation = 0;  ///< largest one [m/s, rad/s; roll and pitch rad]
  double cost = 0;       ///< cost of the constraints if they are soft: ½ Σ (violation / σ)²
};
/// Evaluates the constraints at the problem's current values, whether or not they are part of the problem.
ConstraintCheck check(const TrackingProblem& tracking, const TrackingNoise& noise,
                      const TargetConstraints& constraints);

/// Number of intervals between keyframes in which the target exceeds limits.
struct LimitCheck {
  int outside = 0;    ///< intervals in which a limit is exceeded by more than 3 σ of the soft limits
  int intervals = 0;  ///< intervals with a pose at both ends
};
/// Counts the intervals at the problem's current values that exceed the limits on surge and yaw rate.
LimitCheck count_outside(const TrackingProblem& tracking, const TrackingNoise& noise, const TargetConstraints& limits);

}  // namespace tandem
