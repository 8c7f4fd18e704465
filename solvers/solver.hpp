#pragma once

#include <memory>

#include <tandem/solvers/augmented_lagrangian.hpp>

namespace tandem {

/// Solves one problem repeatedly by augmented-lagrangian, which without hard constraints equals gauss-newton.
///
/// Patterns, symbolic analysis and memory are kept while values, measurements (Problem::set_residual), noise, losses or
/// bounds change. If variables or blocks have been added, removed or fixed, the next solve repeats the analysis. Each
/// solve is bitwise equal to solve(problem, options). Solvers of different problems may run concurrently.
class Solver {
 public:
  /// The problem must outlive this object.
  explicit Solver(Problem& problem, AugmentedLagrangianOptions options = {});
  ~Solver();

  /// Options of the next solve; a change of `secant_pairs` has no effect after the first one. With `from_multipliers`,
  /// a solve starts with the multipliers of the last one.
  AugmentedLagrangianOptions& options() { return options_; }
  /// Solves the problem; its variables get the best point found. If why_unsupported() gives a reason, the status is
  /// `unsupported`.
  Summary solve();
  int analyses() const { return analyses_; }

 private:
  Problem& problem_;
  AugmentedLagrangianOptions options_;
  std::unique_ptr<detail::LevenbergMarquardt> analysed_;
  int analyses_ = 0;
};

}  // namespace tandem
