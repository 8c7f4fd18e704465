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
  std::string text, further;
  std::size_t variables = 0;
  for (const UnobservableState& state : states) {
    if (state.variable.empty()) {
      further = "; and " + state.directions[0];
    } else if (++variables <= kNamed) {
      text += (variables > 1 ? "; " : "") + state.variable + " in ";
      for (std::size_t i = 0; i < state.directions.size(); ++i) text += (i ? ", " : "") + state.directions[i];
    }
  }
  if (variables > kNamed)
    text += "; and " + std::to_string(variables - kNamed) +
            (variables == kNamed + 1 ? " more variable" : " more variables");
  return text + further;
}

std::string describe(const std::vector<UnobservableState>& states) {
  return states.empty() ? "" : state_names(states) + " (add a residual that observes them, or fix them)";
}

}  // namespace tandem
