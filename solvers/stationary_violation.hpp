#pragma once

#include <functional>

#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem::detail {

/// Returns whether X̄ is, up to a few percent, a local minimum of the violation of the hard constraints. Solvers call
/// this before they report infeasible constraints.
///
/// Levenberg–Marquardt steps from X̄ minimise the sum of squared violations. X̄ is not a minimum if they reduce this
/// sum and also the sum of violations, which Ipopt minimises. Both are in the units of the rows. The point of the
/// evaluator is X̄ afterwards.
bool violation_is_stationary(NlpEvaluator& nlp);

/// How minimize_violation() has ended.
enum class LeastViolation {
  feasible,    ///< all hard rows are met
  stationary,  ///< at a stationary point of the violation that is not feasible
  unfinished   ///< at neither: no step reduces the violation, or `should_stop` returned true
};

/// Minimises the sum of squared violations, in the units of the rows, from X̄ on, and moves X̄ to the result. Ignores
/// the cost. Calls `should_stop` before each step. Costs about as much as a solve, without the residuals of the cost.
LeastViolation minimize_violation(NlpEvaluator& nlp, const std::function<bool()>& should_stop);

}  // namespace tandem::detail
