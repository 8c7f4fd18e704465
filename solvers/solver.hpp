#pragma once

#include <memory>

#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/nlopt.hpp>
#include <tandem/solvers/persistent_solve.hpp>

namespace tandem {

/// Solves one problem repeatedly with any solver:
///
///   Solver solver(problem);  // augmented-lagrangian; without hard constraints, this equals gauss-newton
///   Solver other(problem, IpoptOptions{});
///
/// Patterns are kept while values, measurements (Problem::set_residual), noise, losses or bounds change;
/// augmented-lagrangian and gauss-newton also keep the symbolic analysis and the memory. If variables or blocks have
/// been added, removed or fixed, the next solve repeats the analysis. Each solve is bitwise equal to solve(problem,
/// options). Solvers of different problems may run concurrently.
template <class Options = AugmentedLagrangianOptions>
class Solver {
 public:
  /// The problem must outlive this object.
  explicit Solver(Problem& problem, Options options = {});
  Solver(const Solver&) = delete;  // the analysis refers to options_
  Solver& operator=(const Solver&) = delete;

  /// Options of the next solve; a change of `secant_pairs` has no effect after the first one. With `from_multipliers`,
  /// a solve starts with the multipliers of the last one.
  Options& options() { return options_; }
  /// Solves the problem; its variables get the best point found. `unsupported` if why_unsupported() gives a reason.
  Summary solve();
  int analyses() const { return analyses_; }

 private:
  Problem& problem_;
  Options options_;
  std::unique_ptr<detail::PersistentSolve> analysed_;
  int analyses_ = 0;
};

extern template class Solver<GaussNewtonOptions>;
extern template class Solver<AugmentedLagrangianOptions>;
extern template class Solver<IpoptOptions>;
extern template class Solver<NloptOptions>;

}  // namespace tandem
