#pragma once

#include <optional>
#include <string>

#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem {

/// Which constraints on the target's motion are meant, whatever holds them.
struct TargetConstraints {
  bool non_holonomic = false, roll_pitch = false;
  std::optional<Bounds<1>> surge{};      ///< m/s
  std::optional<double> max_yaw_rate{};  ///< rad/s
};

/// Those that the options ask for: non-holonomic when soft or hard, roll-pitch when hard (soft, it is part of every
/// problem), and the limits.
TargetConstraints constraints_of(const TrackingOptions& options);

/// The options with all of these constraints off, soft or hard.
TrackingOptions with_constraints(TrackingOptions options, const TargetConstraints& constraints, Role role);

/// "non-holonomic, surge within 0 … 2.5 m/s".
std::string describe(const TargetConstraints& constraints);

/// How far the target's consecutive poses are outside the constraints, whether these were held or not.
struct ConstraintCheck {
  double violation = 0;  ///< the largest [m/s, rad/s; roll and pitch rad]
  double cost = 0;       ///< ½ Σ (outside / σ)², what the constraints cost when soft
};
ConstraintCheck check(const TrackingProblem& tracking, const TrackingNoise& noise,
                      const TargetConstraints& constraints);

/// How many intervals between keyframes are outside limits on surge and yaw rate by more than three of the standard
/// deviations by which soft limits are held.
struct LimitCheck {
  int intervals = 0, of = 0;
};
LimitCheck count_outside(const TrackingProblem& tracking, const TrackingNoise& noise, const TargetConstraints& limits);

}  // namespace tandem
