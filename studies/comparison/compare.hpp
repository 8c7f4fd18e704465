#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/estimation/target_constraints.hpp>

namespace tandem {

/// A solver under the name that a comparison gives it.
struct Contender {
  std::string name;
  Solver solver;
  bool dense = false;  ///< keeps dense matrices, so takes small problems only
};

/// All of this build: gauss-newton, augmented-lagrangian, ipopt (its Hessian chosen automatically), ipopt:HESSIAN and
/// nlopt:ALGORITHM.
std::vector<Contender> contenders();

/// Names by commas; "nlopt" is all of its algorithms, "all" every solver. Throws Error.
std::vector<Contender> parse_contenders(const std::string& option, const std::string& text);
/// none, soft and hard by commas. Throws Error.
std::vector<Role> parse_constraints(const std::string& option, const std::string& text);
/// "none", "soft" or "hard".
std::string_view constraints_name(Role role);

/// The problem on which solvers are compared.
struct ComparedProblem {
  TrackingOptions tracking;  ///< `max_keyframes` says how many; its constraints are held as `role` says
  TargetConstraints constraints;
  Role role = Role::off;
  double time_limit = 60;  ///< s, of the solve
};

/// Where a solve was at some time.
struct CurvePoint {
  double seconds, cost, violation;
};

/// How one solver did, from the problem's own start.
struct ComparedSolve {
  std::string solver;
  Role role = Role::off;
  std::size_t keyframes = 0;
  /// name(Status), or "crashed": the process ended without a result, by a signal or after it ran on past its limit.
  std::string status, message;
  bool solved = false;  ///< the numbers below are there
  double initial_cost = 0;
  double cost = 0;             ///< what the solver minimised, soft constraints included
  double constraint_cost = 0;  ///< of it, what soft constraints cost; cost − constraint_cost compares across roles
  double violation = 0;        ///< of the constraints, held or not [m/s, rad/s, rad]
  int iterations = 0, evaluations = 0;
  double seconds = 0;
  double peak_memory = 0;           ///< bytes; 0 when not known
  std::optional<double> position;   ///< mean error over all keyframes that the truth covers [m]
  std::optional<double> heading;    ///< mean magnitude of the relative heading's error [deg]
  std::vector<CurvePoint> curve{};  ///< some 50 points a decade of time

  bool converged() const { return status == name(Status::converged); }
};

/// Solves in this process. Throws Error when data and options make no problem; what goes wrong later is in the result.
ComparedSolve compare_one(const Scenario& scenario, const ComparedProblem& problem, const Contender& contender);

/// What compare_one() gave as text, all of it but the memory, and back.
std::string to_text(const ComparedSolve& solve);
ComparedSolve compared_solve(const std::string& text);

/// A solve by this program in a process of its own, which measures the memory and survives a crash: run with these
/// arguments it prints to_text() of it. See run_isolated(). `contender`, `role`: which solve it is, where it gives none.
ComparedSolve compare_isolated(std::vector<std::string> arguments, const Contender& contender, Role role,
                               double seconds, const std::atomic<bool>& stop);

}  // namespace tandem
