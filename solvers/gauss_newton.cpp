#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/persistent_solve.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {

std::string why_unsupported(const Problem& problem, const GaussNewtonOptions& options) {
  detail::check("gauss-newton", options);
  if (problem.num_hard_blocks() == 0) return detail::why_unsolvable(problem);
  return "gauss-newton takes soft residuals only, and this problem has " + std::to_string(problem.num_hard_blocks()) +
         " hard ones: use augmented-lagrangian or ipopt, or nlopt for a small problem";
}

Summary solve(Problem& problem, const GaussNewtonOptions& options) {
  if (const std::string why = why_unsupported(problem, options); !why.empty())
    return detail::rejection("gauss-newton", options, why);
  return detail::analyse(problem, options)->solve();
}

std::unique_ptr<detail::PersistentSolve> detail::analyse(Problem& problem, const GaussNewtonOptions& options) {
  return std::make_unique<LevenbergMarquardt>(problem, "gauss-newton", options);
}

}  // namespace tandem
