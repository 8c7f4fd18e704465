#include <tandem/studies/support/solver_choice.hpp>

namespace tandem {

SolverOptions& common(AnySolver& solver) {
  return std::visit([](SolverOptions& options) -> SolverOptions& { return options; }, solver);
}

const SolverOptions& common(const AnySolver& solver) {
  return std::visit([](const SolverOptions& options) -> const SolverOptions& { return options; }, solver);
}

bool supports_hard_limits(const AnySolver& solver) {
  if (std::holds_alternative<GaussNewtonOptions>(solver)) return false;
  if (const auto* const ipopt = std::get_if<IpoptOptions>(&solver)) return ipopt->hessian != Hessian::limited_memory;
  const auto* const nlopt = std::get_if<NloptOptions>(&solver);
  if (!nlopt) return true;
  const std::string& name = nlopt->algorithm;
  return name == "slsqp" || name == "mma" || name == "ccsaq" || name.starts_with("auglag");
}

std::vector<std::string> solver_names() {
  std::vector<std::string> names = {"gauss-newton", "augmented-lagrangian", "ipopt"};
  for (const std::string& algorithm : nlopt_algorithms()) names.push_back("nlopt:" + algorithm);
  return names;
}

}  // namespace tandem
