#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/estimation/target_constraints.hpp>

namespace tandem {

/// A solver with its options, and the name that selects it.
struct NamedSolver {
  std::string name;
  AnySolver solver;
  bool dense = false;  ///< whether it stores dense matrices, and suits small problems only
};

/// Returns all solvers of this build: gauss-newton, augmented-lagrangian, ipopt (automatic choice of the Hessian),
/// ipopt:HESSIAN, nlopt:ALGORITHM.
std::vector<NamedSolver> available_solvers();

/// Parses a comma-separated list of solver names; "nlopt" stands for all its algorithms, "all" for every solver. Throws
/// Error with the name of the option.
std::vector<NamedSolver> parse_solver_list(const std::string& option, const std::string& text);
/// Parses a comma-separated list of off, soft and hard. Throws Error with the name of the option.
std::vector<Role> parse_constraints(const std::string& option, const std::string& text);
/// Returns "off", "soft" or "hard".
std::string_view constraints_name(Role role);

/// A problem on which solvers are compared.
struct ComparedProblem {
  TrackingOptions tracking;  ///< `role` overrides its constraints; `max_keyframes` limits the size
  TargetConstraints constraints;
  Role role = Role::off;
  double time_limit = 60;  ///< time limit of the solve [s]
};

/// Progress of a solve.
struct CurvePoint {
  double seconds, cost, violation;
};

/// Result of one solver, from the problem's own initial guess.
struct ComparedSolve {
  std::string solver;
  Role role = Role::off;
  std::size_t keyframes = 0;
  /// name(Status), or "crashed" if the process ended without a result, by a signal or because it exceeded its time
  /// limit.
  std::string status, message;
  bool solved = false;  ///< whether the numbers below are valid
  double initial_cost = 0;
  double cost = 0;             ///< final cost, including soft constraints
  double constraint_cost = 0;  ///< cost of the soft constraints; cost − constraint_cost is comparable between roles
  double violation = 0;        ///< largest violation of the constraints, even if they are off [m/s, rad/s, rad]
  int iterations = 0, evaluations = 0;
  double seconds = 0;
  double peak_memory = 0;           ///< bytes; 0 if unknown
  std::optional<double> position;   ///< mean position error over the keyframes that the truth covers [m]
  std::optional<double> heading;    ///< mean absolute error of the relative heading [deg]
  std::vector<CurvePoint> curve{};  ///< about 50 points per decade of time

  bool converged() const { return status == name(Status::converged); }
};

/// Runs a solve in this process. Throws Error if data and options give no valid problem; later errors are in the
/// result.
ComparedSolve run_compared_solve(const Scenario& scenario, const ComparedProblem& problem, const NamedSolver& solver);

/// Serialises a result, without the memory.
std::string to_text(const ComparedSolve& solve);
/// Parses to_text().
ComparedSolve parse_compared_solve(const std::string& text);

/// Runs this program with `arguments` in a separate process, which must print to_text() of one solve. This measures the
/// memory and survives crashes. `solver` and `role` identify the solve if there is no result. See run_subprocess() for
/// `seconds` and `stop`.
ComparedSolve compare_in_subprocess(std::vector<std::string> arguments, const NamedSolver& solver, Role role,
                                    double seconds, const std::atomic<bool>& stop);

}  // namespace tandem
