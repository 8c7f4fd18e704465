#pragma once

#include <chrono>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/summary.hpp>

namespace tandem::detail {

/// Tolerance on the violation of a hard constraint, in the units of the row. See also row_tolerances().
inline constexpr double kConstraintTolerance = 1e-8;

/// Returns the tolerance on the violation of each row: `tolerance` or, if larger, the rounding error of the row. No
/// solver can meet a row of large terms better, for example x² = 1000² in metres. `jacobian` is that of the rows at X̄.
Eigen::VectorXd row_tolerances(const NlpEvaluator& nlp, const Eigen::VectorXd& jacobian, double tolerance);
/// Returns the largest violation of a hard row c relative to `tolerances`; above 1 if the row is violated.
NlpEvaluator::Violation relative_violation(const NlpEvaluator& nlp, const Eigen::VectorXd& c,
                                           const Eigen::VectorXd& tolerances);
/// Returns the row with the largest relative violation at X̄, −1 if all hard rows are met.
int violated_row(NlpEvaluator& nlp, const Eigen::VectorXd& c, double tolerance);

struct Workspace;

/// Bookkeeping of a solve: time, limits, progress reports, summary.
class Session {
 public:
  Session(std::string solver, const SolverOptions& options);

  void restart();
  double seconds() const;
  /// Returns true, and sets the status, if the caller or the time limit requires a stop.
  bool should_stop();
  /// Evaluates `cost()` and the constraints at the initial guess. Returns false if one of them is undefined or not
  /// finite, or if a constraint on fixed variables is violated. The solve has then ended; the message names the block.
  bool start(NlpEvaluator& nlp, const std::function<double()>& cost);
  /// Reports an iteration at X̄ to the caller.
  void report(int iteration, double cost, double step, double violation) const;
  /// Reports an iteration at X̄ ⊕ delta, which becomes the point of the evaluator.
  void report_at(NlpEvaluator& nlp, const Eigen::VectorXd& delta, int iteration, double cost, double step,
                 double violation) const;
  /// Sets the status and the message. If the message is empty, the summary has the sentence of the status. Later calls
  /// have no effect.
  void end(Status status, std::string message = {});
  bool ended() const { return ended_; }
  /// Evaluates the solution X̄: cost, violation and observability. A converged solve becomes a failed one if a
  /// constraint is violated by more than `feasible` and its rounding error. Must be called last, as `work` is
  /// overwritten.
  void conclude(NlpEvaluator& nlp, double feasible, const Workspace* work = nullptr);

  /// Adds the time until the end of the scope to `total`.
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

/// Explains why no step lowers the cost, for use at the end of a message. Empty if the derivatives are consistent.
std::string derivative_hint(const NlpEvaluator::DerivativeCheck& check);

/// Returns the summary of a solver that does not support the problem.
Summary rejection(std::string solver, const SolverOptions& options, std::string why);

/// Returns an empty string, or the reason why no solver supports the problem: no free variable. Also names a hard
/// constraint that the fixed variables violate.
std::string why_unsolvable(const Problem& problem);

}  // namespace tandem::detail
