#pragma once

#include <atomic>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace tandem {

/// Reason why a solve ended.
enum class Status {
  /// A stationary point within the tolerances: the first-order (Karush–Kuhn–Tucker) conditions hold. From almost every
  /// initial guess it is a local minimum; a solve from an exact maximum or saddle point ends there.
  converged,
  max_iterations,  ///< The limit of iterations or evaluations.
  time_limit,      ///< The time limit.
  interrupted,     ///< Stopped by the caller.
  infeasible,      ///< The solver found no point that meets the hard constraints.
  unsupported,     ///< The solver does not support the problem; the message gives the reason.
  failed,          ///< Numerical failure; the message gives the cause.
};

/// Returns "converged", "max-iterations", …
std::string_view name(Status status);
/// Returns one sentence for the user.
std::string_view sentence(Status status);

/// A variable that the problem does not observe completely, with its unobservable directions.
struct UnobservableState {
  std::string variable;                 ///< name, for example "target 4"; empty for a count of further directions
  std::vector<std::string> directions;  ///< tangent entries, for example "x" or "rotation about z"
};
/// Returns for example "target 4 in x, y; target 5 in x". Names the first three variables and the number of the others.
/// Empty without states.
std::string state_names(const std::vector<UnobservableState>& states);
/// Returns state_names() with a remedy for programs: "target 4 in x (add a residual that observes them, or fix them)".
/// Empty without states.
std::string describe(const std::vector<UnobservableState>& states);

/// Result of a solve. The variables of the problem have the best point found, for any status. Costs and violation are
/// NaN if they were not computed, because the problem is not supported or a residual is undefined.
struct Summary {
  std::string solver;
  Status status = Status::failed;
  std::string message;  ///< one sentence: why the solve ended
  /// Directions along which the cost does not change at the solution. They are a property of the problem, not of the
  /// solve, so the status does not depend on them. Their covariances are infinite (Marginals). Determined for converged
  /// solves.
  std::vector<UnobservableState> unobservable;
  double initial_cost = 0, cost = 0;
  double max_violation = 0;      ///< largest violation of a hard constraint, in its own units
  std::string worst_constraint;  ///< residual and variables of the most violated hard constraint; empty if all are met
  /// Iterations, and evaluations of the cost. NLopt counts evaluations only; both are then equal.
  int iterations = 0, evaluations = 0;
  double seconds = 0;
  double evaluation_seconds = 0;     ///< time of residuals and Jacobians
  double linear_solver_seconds = 0;  ///< time of factorisations and solves; Ipopt: all but evaluations

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
  bool observability = true;  ///< determines Summary::unobservable, which costs about as much as an iteration
  /// Starts from the multipliers of the hard blocks (Problem::multipliers), as left by an earlier solve of a similar
  /// problem. Only for solvers that have multipliers.
  bool from_multipliers = false;
  /// Called once per iteration, while the variables have the values of the iterate. It may read them and compute
  /// Marginals. It must neither change nor solve the problem; if it adds, removes or fixes variables or blocks, every
  /// solver throws Error. Exceptions end the solve and propagate to its caller.
  std::function<void(const Progress&)> progress;
};

}  // namespace tandem
