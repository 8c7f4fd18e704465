#include <tandem/lie/error.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/persistent_solve.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {

std::string why_unsupported(const Problem& problem, const AugmentedLagrangianOptions& options) {
  detail::check("augmented-lagrangian", options);
  if (!(options.initial_penalty > 0)) throw BadInputError("augmented-lagrangian: initial_penalty must be positive");
  return detail::why_unsolvable(problem);
}

Summary solve(Problem& problem, const AugmentedLagrangianOptions& options) {
  if (const std::string why = why_unsupported(problem, options); !why.empty())
    return detail::rejection("augmented-lagrangian", options, why);
  return detail::analyse(problem, options)->solve();
}

std::unique_ptr<detail::PersistentSolve> detail::analyse(Problem& problem, const AugmentedLagrangianOptions& options) {
  return std::make_unique<LevenbergMarquardt>(problem, "augmented-lagrangian", options, &options.initial_penalty);
}

}  // namespace tandem
