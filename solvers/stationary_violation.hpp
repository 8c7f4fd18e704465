#pragma once

#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem::detail {

/// Returns whether X̄ is, up to a few percent, a local minimum of the violation of the hard constraints. Solvers call
/// this before they report infeasible constraints.
///
/// Levenberg–Marquardt steps from X̄ minimise the sum of squared violations. X̄ is not a minimum if they reduce this
/// sum and also the sum of violations, which Ipopt minimises. Both are in the units of the rows. The point of the
/// evaluator is X̄ afterwards.
bool violation_is_stationary(NlpEvaluator& nlp);

}  // namespace tandem::detail
