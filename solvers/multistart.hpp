#pragma once

#include <functional>
#include <limits>
#include <span>

#include <tandem/problem/stop.hpp>
#include <tandem/problem/subproblem.hpp>

namespace tandem {

/// Options of solve_part_from().
struct MultistartOptions {
  double min_gain = 0;  ///< Minimum decrease of the cost for the result of a trial to be used.
  /// A trial is abandoned if its cost exceeds the best one by more than `cost_margin` and by more than `patience` times
  /// its recent decrease per iteration. With hard constraints, it continues while no feasible point is known or while
  /// its violation decreases.
  double cost_margin = 0, patience = 20;
  int max_iterations = 1000;  ///< per trial
  /// Called once per iteration, while the problem has the values of the trial. Returns whether the trial has returned
  /// to the original solution and can be abandoned.
  std::function<bool()> has_returned{};
  Stop stop{};  ///< ends the present trial and skips the others
};

/// Result of solve_part_from().
struct MultistartOutcome {
  int best = -1;       ///< index of the best start; −1 if none is better than the original values
  double gain = 0;     ///< decrease of the cost; negative if a violated constraint is now met
  int iterations = 0;  ///< sum over all trials
  int evaluations = 0;
};

/// Result of one trial.
struct Trial {
  double cost;     ///< last cost; NaN if undefined
  bool completed;  ///< false if the trial was abandoned or stopped, or if its result is infeasible
};

/// Solves a part from its present values, which it keeps. The trial is compared with `best`, the best cost known.
Trial solve_trial(Subproblem& part, double best, const MultistartOptions& options);

/// Solves a part of a problem from several starts and keeps the best values.
///
/// The part consists of the variables with the given ids; all others are fixed. Each start sets the values of these
/// variables in `problem`. The original values are kept if no completed trial is better. Feasible values are better
/// than infeasible ones; among feasible ones the lower cost is better.
///
/// Trials use gauss-newton or, with hard constraints, augmented-lagrangian. A trial takes as long as a problem of the
/// size of the part. The method suits parts that are weakly coupled to the rest. Call it after the whole problem has
/// been solved, and solve the whole again if the cost has decreased.
///
/// Does nothing if all variables of the part are fixed. Throws Error like Subproblem does. Exceptions of `starts` and
/// `has_returned` propagate, and the best values so far are kept.
MultistartOutcome solve_part_from(std::span<const std::function<void()>> starts, Problem& problem,
                                  std::span<const int> variable_ids, const MultistartOptions& options = {});

}  // namespace tandem
