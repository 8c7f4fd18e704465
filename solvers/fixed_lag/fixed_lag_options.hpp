#pragma once

#include <functional>

#include <tandem/solvers/summary.hpp>

namespace tandem {

/// Options of a fixed-lag smoother.
struct FixedLagOptions : SolverOptions {
  FixedLagOptions() { max_iterations = 5; }  // per update

  double window = 60.0;   ///< length of the window [s], back from the newest variable
  int max_keyframes = 0;  ///< maximum number of distinct times (at least 1 ms apart); 0 for no limit
  /// Fraction by which the window may exceed `window` and `max_keyframes` while updates do not converge.
  /// Marginalization fixes the linearisation point, so a later update gets a chance to improve the estimate first. The
  /// time and memory of an update grow accordingly. With 0, variables always leave on time.
  double patience = 0.5;
  /// An update has converged if the predicted gain of a step, or of the next step by the gradient after it, is below
  /// this fraction of max(cost, 1).
  double cost_tolerance = 1e-6;
  double step_tolerance = 1e-9;    ///< alternatively, the largest entry of a step [m, rad]
  double initial_damping = 1e-15;  ///< relative to the diagonal; warm starts need undamped steps
  /// Called after the solve for each time that is about to leave, oldest first. Its variables have their final values,
  /// and their handles are still valid. If it throws, the variables remain, and the next update calls it again.
  std::function<void(double t)> before_marginalize;
};

}  // namespace tandem
