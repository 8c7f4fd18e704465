#include <tandem/solvers/summary.hpp>

namespace tandem {

std::string_view name(Status status) {
  constexpr std::string_view names[] = {"converged",  "max-iterations", "time-limit",  "interrupted",
                                        "infeasible", "rank-deficient", "unsupported", "failed"};
  return names[int(status)];
}

std::string_view sentence(Status status) {
  constexpr std::string_view sentences[] = {
      "found a local minimum within the tolerances",
      "the iteration limit was reached",
      "the time limit was reached",
      "interrupted by the caller",
      "found no point that meets all hard constraints",
      "the problem is rank deficient: a direction of some variable is unobservable",
      "the solver does not support the problem",
      "numerical failure"};
  return sentences[int(status)];
}

}  // namespace tandem
