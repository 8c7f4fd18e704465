#pragma once

#include <atomic>
#include <functional>
#include <limits>
#include <string>
#include <string_view>

namespace tandem {

/// Reason why a solve ended.
enum class Status {
  converged,       ///< a local minimum within the tolerances
  max_iterations,  ///< the limit of iterations or evaluations
  time_limit,      ///< the time limit
  interrupted,     ///< stopped by the caller
  infeasible,      ///< the solver found no point that meets the hard constraints
  rank_deficient,  ///< a direction of some variable is unobservable; the message names it
  unsupported,     ///< the solver does not support the problem; the message gives the reason
  failed,          ///< numerical failure; the message gives the cause
};

/// Returns "converged", "max-iterations", …
std::string_view name(Status status);
/// Returns one sentence for the user.
std::string_view sentence(Status status);

/// Result of a solve. The variables of the problem have the best point found, whatever the status. Costs and violation
/// are NaN if they were not computed, because the problem is not supported or a residual is undefined.
struct Summary {
  std::string solver;
  Status status = Status::failed;
  std::string message;  ///< one sentence: why the solve ended
  double initial_cost = 0, cost = 0;
  double max_violation = 0;      ///< largest violation of a hard constraint, in its own units
  std::string unobservable;      ///< if rank deficient: variables and directions, e.g. "x0 in heading; x1 in x, y"
  std::string worst_constraint;  ///< residual and variables of the most violated hard constraint; empty if all are met
  /// Iterations, and evaluations of the cost. NLopt counts evaluations only; both are then equal.
  int iterations = 0, evaluations = 0;
  double seconds = 0;
  double evaluation_seconds = 0;     ///< of residuals and Jacobians
  double linear_solver_seconds = 0;  ///< of factorisations and solves; for Ipopt all time but evaluations

  bool converged() const { return status == Status::converged; }
};

/// Report of one iteration.
struct Progress {
  int iteration;
  double cost;
  double step;       ///< norm of the last step in the tangent space; NaN if the library does not report it
  double violation;  ///< largest violation of a hard constraint
  double seconds;
};

/// Options of all solvers.
struct SolverOptions {
  int max_iterations = 1000;                                    ///< limit of iterations
  double time_limit = std::numeric_limits<double>::infinity();  ///< [s]
  const std::atomic<bool>* stop = nullptr;  ///< ends the solve at the best point once true; any thread may set it
  /// Maximum number of threads of an evaluation; 0 uses one per core. Results are bitwise independent of it.
  int threads = 0;
  /// Starts from the multipliers of the hard blocks (Problem::multipliers), as left by an earlier solve of a similar
  /// problem. Only for solvers that have multipliers.
  bool from_multipliers = false;
  /// Called once per iteration, while the variables have the values of the iterate. It may read them and compute
  /// Marginals. It must neither change nor solve the problem. Exceptions end the solve and propagate to its caller.
  std::function<void(const Progress&)> progress;
};

}  // namespace tandem
