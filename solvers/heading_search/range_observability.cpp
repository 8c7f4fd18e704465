#include <cmath>

#include <tandem/solvers/heading_search/range_observability.hpp>

namespace tandem {

bool range_is_observable(const TrackingProblem& tracking, const Marginals& marginals) {
  constexpr double kMinInformation = 4, kMaxMove = 0.5;  // information and move of the logarithm of the range
  if (!tracking.assumed_range) return true;
  const Problem::Linearization at = tracking.problem.linearization(tracking.assumed_range->block);
  const double variance = marginals.propagated(at.jacobian, at.variable_ids, at.dofs)(0, 0);
  const double information = 1 / variance - 1;  // without the information of the assumed range, whose variance is 1
  return information >= kMinInformation && std::abs(at.residual[0]) <= kMaxMove * information;
}

}  // namespace tandem
