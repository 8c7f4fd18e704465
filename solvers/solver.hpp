#pragma once

#include <memory>

#include <tandem/solvers/augmented_lagrangian.hpp>

namespace tandem {

/// Solves one problem again and again, by augmented-lagrangian, which without hard constraints is gauss-newton. Patterns,
/// symbolic analysis and memory are kept from solve to solve, while values, measurements (Problem::set_residual), noise,
/// losses and bounds change; after variables or blocks have joined or left, or were fixed, the next solve analyses anew.
/// Each solve is what solve(problem, options) is, to the last bit.
class Solver {
 public:
  /// The problem must live as long.
  explicit Solver(Problem& problem, AugmentedLagrangianOptions options = {});
  ~Solver();

  /// For the next solve, but for secant_pairs; with from_multipliers it starts where the last one ended.
  AugmentedLagrangianOptions& options() { return options_; }
  /// Leaves the best point found in the problem's variables, whatever the status; `unsupported` where why_unsupported().
  Summary solve();
  /// How often it has analysed the problem.
  int analyses() const { return analyses_; }

 private:
  Problem& problem_;
  AugmentedLagrangianOptions options_;
  std::unique_ptr<detail::LevenbergMarquardt> analysed_;
  int analyses_ = 0;
};

}  // namespace tandem
