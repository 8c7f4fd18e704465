#pragma once

#include <memory>

#include <tandem/solvers/summary.hpp>

namespace tandem {

class Problem;
struct AugmentedLagrangianOptions;
struct GaussNewtonOptions;
struct IpoptOptions;
struct NloptOptions;

namespace detail {

/// A solve of one problem that can be repeated. It keeps what depends only on the variables and blocks of the problem.
class PersistentSolve {
 public:
  virtual ~PersistentSolve() = default;
  /// Returns whether solve() may be called: no variable or block has been added, removed or fixed since construction.
  virtual bool is_current() const = 0;
  /// Solves the problem, which must be supported.
  virtual Summary solve() = 0;
};

/// Analyse a supported problem for each solver. The problem and the options must outlive the result.
std::unique_ptr<PersistentSolve> analyse(Problem& problem, const GaussNewtonOptions& options);
std::unique_ptr<PersistentSolve> analyse(Problem& problem, const AugmentedLagrangianOptions& options);
std::unique_ptr<PersistentSolve> analyse(Problem& problem, const IpoptOptions& options);
std::unique_ptr<PersistentSolve> analyse(Problem& problem, const NloptOptions& options);

}  // namespace detail
}  // namespace tandem
