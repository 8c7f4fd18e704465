#pragma once

#include <functional>
#include <limits>
#include <span>

#include <tandem/problem/problem_part.hpp>
#include <tandem/problem/stop.hpp>

namespace tandem {

/// How a part of a problem is tried from other starts.
struct MultistartOptions {
  double least_gain = 0;  ///< of cost, for the values of a trial to be taken
  /// A trial is given up when its cost is above the best by more than `near` and by more than `patience` of its recent
  /// decreases in one iteration; under hard constraints not while their violation falls, nor before they were met once.
  double near = 0, patience = 20;
  int max_iterations = 1000;  ///< of one trial
  /// Asked once an iteration, while the problem has the trial's values: whether it is back where the part was at first,
  /// and so not worth solving to the end.
  std::function<bool()> back{};
  Stop stop{};  ///< ends a trial, and all that follow
};

/// What the trials gave.
struct MultistartOutcome {
  int best = -1;       ///< the start that led lowest, −1 where none did
  double gain = 0;     ///< what it lowered the cost by; below zero where hard constraints were violated and now hold
  int iterations = 0;  ///< of all trials together
  int evaluations = 0;
};

/// Solves a part of a problem, the variables of these ids, from several starts with all others fixed, and leaves the best
/// values: those of a trial that was not given up, or what was there. Values that meet the hard constraints are better than such
/// as do not, and of two that do the better cost less. Each start sets values of these variables in `problem`. Trials are
/// solved by gauss-newton, under hard constraints by augmented-lagrangian, and take the time of a problem of the part's
/// size. For parts that hang together with the rest by little, after the whole has been solved; solve it again where
/// something was gained. Where nothing of the part is free there is nothing to try. Throws Error as ProblemPart does; what
/// a start or `back` throws comes out of it, the best values so far being left.
MultistartOutcome solve_part_from(std::span<const std::function<void()>> starts, Problem& problem,
                                  std::span<const int> variable_ids, const MultistartOptions& options = {});

}  // namespace tandem
