#pragma once

#include <functional>

#include <tandem/solvers/summary.hpp>

namespace tandem {

/// How far back the window reaches, and what one update may do.
struct FixedLagOptions : SolverOptions {
  FixedLagOptions() { max_iterations = 5; }  // an update

  double window = 60.0;   ///< s: variables older than the newest by more than this are marginalized
  int max_keyframes = 0;  ///< and those beyond so many distinct times (1 ms apart at the least); 0: no such limit
  /// What leaves is linearised for the last time, so nothing leaves after an update that has not converged, until the
  /// window is longer than it should be by this part of `window` or `max_keyframes`: so much a later update may still
  /// mend, and so much more memory and time an update may take. 0: all leave in time, whatever their estimate is worth.
  double patience = 0.5;
  /// An update has converged when what a step is predicted to gain, or what a further one would by the gradient after
  /// it, is below this part of the cost, or of 1 where that is more.
  double cost_tolerance = 1e-6;
  double step_tolerance = 1e-9;    ///< or when no entry of a step is larger [m, rad]
  double initial_damping = 1e-15;  ///< of the diagonal: a warm start wants whole Gauss-Newton steps
  /// Told each time that is about to leave the window, oldest first, after the solve: its variables have their last
  /// values, and their handles are valid for the last time. When it throws, what it was told stays, to be told again by
  /// the next update.
  std::function<void(double t)> leaving;
};

}  // namespace tandem
