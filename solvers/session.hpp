#pragma once

#include <chrono>

#include <tandem/problem/program.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem::detail {

/// Hard constraints hold when no row is outside its bounds by more than this, in the row's own units.
inline constexpr double kConstraintTolerance = 1e-8;

struct Workspace;

/// What every solver does around its iterations: it keeps the time, asks whether to stop, reports, and ends a solve.
class Session {
 public:
  Session(std::string solver, const SolverOptions& options);

  /// As if it were new.
  void restart();
  double seconds() const;
  /// True when the caller or the clock says so; the status is then set.
  bool should_stop();
  /// Measures the start by `cost()`, which evaluates the program's cost. False when a residual is undefined or not
  /// finite there: the solve has then failed, and the message names the block.
  bool start(Program& program, const std::function<double()>& cost);
  /// Tells the caller of an iteration whose iterate is X̄, or X̄ ⊕ delta, which is then the program's point.
  void report(int iteration, double cost, double step, double violation) const;
  void report_at(Program& program, const Eigen::VectorXd& delta, int iteration, double cost, double step,
                 double violation) const;
  /// Sets status and message; an empty message is the status's own sentence. The first to call wins.
  void end(Status status, std::string message = {});
  bool ended() const { return ended_; }
  /// Measures the solution, X̄ of the program: cost, violation of the hard constraints, and whether a solve that
  /// converged left a variable free or a constraint violated by more than `feasible`. The last thing a solver does, so
  /// that it may lend what it has of memory.
  void conclude(Program& program, double feasible, const Workspace* work = nullptr);

  /// Adds the time until it goes out of scope to a figure of the summary.
  class Timer {
   public:
    explicit Timer(double& total) : total_(total), start_(std::chrono::steady_clock::now()) {}
    ~Timer() { total_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

   private:
    double& total_;
    std::chrono::steady_clock::time_point start_;
  };

  Summary summary;

 private:
  const SolverOptions& options_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  bool ended_ = false;
};

/// What follows "no step lowers the cost" in a message; empty where nothing is in doubt.
std::string because(const Program::Doubt& doubt);

/// The summary of a solver that cannot take the problem, for the reason given.
Summary refusal(std::string solver, const SolverOptions& options, std::string why);

/// Empty, or a sentence that says why no solver can take the problem: nothing is free, or there are more hard
/// equalities than unknowns.
std::string why_unsolvable(const Problem& problem);

}  // namespace tandem::detail
