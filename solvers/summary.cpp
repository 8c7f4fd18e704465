#include <algorithm>

#include <tandem/solvers/summary.hpp>

namespace tandem {

std::string_view name(Status status) {
  constexpr std::string_view names[] = {"converged",  "max-iterations", "time-limit", "interrupted",
                                        "infeasible", "unsupported",    "failed"};
  return names[int(status)];
}

std::string_view sentence(Status status) {
  constexpr std::string_view sentences[] = {"found a stationary point within the tolerances",
                                            "the iteration limit was reached",
                                            "the time limit was reached",
                                            "interrupted by the caller",
                                            "found no point that meets all hard constraints",
                                            "the solver does not support the problem",
                                            "numerical failure"};
  return sentences[int(status)];
}

std::string state_names(const std::vector<UnobservableState>& states) {
  constexpr std::size_t kNamed = 3;
  std::string text;
  for (std::size_t k = 0; k < std::min(states.size(), kNamed); ++k) {
    text += (k ? "; " : "") + states[k].variable + " in ";
    for (std::size_t i = 0; i < states[k].directions.size(); ++i) text += (i ? ", " : "") + states[k].directions[i];
  }
  if (states.size() > kNamed)
    text += "; and " + std::to_string(states.size() - kNamed) +
            (states.size() == kNamed + 1 ? " more variable" : " more variables");
  return text;
}

std::string describe(const std::vector<UnobservableState>& states) {
  return states.empty() ? "" : state_names(states) + " (add a residual that observes them, or fix them)";
}

}  // namespace tandem
