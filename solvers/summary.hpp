#pragma once

#include <atomic>
#include <functional>
#include <limits>
#include <string>
#include <string_view>

namespace tandem {

/// Why a solve ended.
enum class Status {
  converged,       ///< a local minimum to the tolerances asked for
  max_iterations,  ///< stopped at the limit of iterations or evaluations
  time_limit,      ///< stopped at the limit of time
  interrupted,     ///< stopped by the caller
  infeasible,      ///< the hard constraints cannot be met together, as far as the solver can tell
  unconstrained,   ///< the problem leaves a direction of some variable free; the message names it
  unsupported,     ///< the solver cannot take this problem; the message says why
  failed,          ///< the numerics gave out; the message says where
};

/// "converged", "max-iterations", …
std::string_view name(Status status);
/// One sentence for a person.
std::string_view sentence(Status status);

/// What a solve did. The problem's variables hold the best point found, whatever the status.
struct Summary {
  std::string solver;
  Status status = Status::failed;
  std::string message;  ///< one sentence: why it stopped
  double initial_cost = 0, cost = 0;
  double max_violation = 0;      ///< of the hard constraints, in their own units
  std::string worst_constraint;  ///< residual and variables of the most violated hard constraint; empty when all hold
  int iterations = 0, evaluations = 0;  ///< evaluations of the cost; NLopt's iterations are its evaluations
  double seconds = 0;
  double evaluation_seconds = 0;     ///< of residuals and Jacobians
  double linear_solver_seconds = 0;  ///< of Gauss-Newton's factorisation and solves; of all else within Ipopt

  bool converged() const { return status == Status::converged; }
};

/// One iteration, as reported while solving.
struct Progress {
  int iteration;
  double cost;
  double step;       ///< norm of the last step in the tangent space; NaN where the library does not tell
  double violation;  ///< largest violation of a hard constraint
  double seconds;
};

/// What every solver understands.
struct SolverOptions {
  int max_iterations = 1000;                                    ///< the status is then max_iterations
  double time_limit = std::numeric_limits<double>::infinity();  ///< s
  const std::atomic<bool>* stop = nullptr;                      ///< set it from anywhere to end at the best point
  /// That evaluate at once, at most; 0: one each core. The result is the same for any number, to the last bit.
  int threads = 0;
  /// Start from the multipliers that the hard blocks have (Problem::multipliers), as an earlier solve left them: of a
  /// problem whose values, measurements or bounds have changed a little since. For the solvers that have multipliers.
  bool from_multipliers = false;
  /// Called once an iteration, while the variables' values are the iterate's: it may read them and compute their
  /// Marginals, but neither change the problem nor solve it. What it throws ends the solve and comes out of it.
  std::function<void(const Progress&)> progress;
};

}  // namespace tandem
