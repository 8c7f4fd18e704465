#include <chrono>
#include <cmath>

#include <tandem/problem/program.hpp>
#include <tandem/solvers/graduated.hpp>

namespace tandem::detail {
namespace {

constexpr double kLeastSquares = 1e6;  // a loss this much wider than its residual is the identity to 1e-12

/// Gives a problem's losses the widening back that they had.
class KeepWidening {
 public:
  explicit KeepWidening(Problem& problem) : problem_(problem), widening_(problem.widening()) {}
  ~KeepWidening() { problem_.widen_losses(widening_); }
  KeepWidening(const KeepWidening&) = delete;
  KeepWidening& operator=(const KeepWidening&) = delete;

 private:
  Problem& problem_;
  double widening_;
};

/// Several solves as one: what the limits leave to the next, and the sums.
class Sequence {
 public:
  explicit Sequence(const SolverOptions& options) : options_(options) {}

  SolverOptions limits() const {
    SolverOptions left = options_;
    left.max_iterations = std::max(0, options_.max_iterations - sum_.iterations);
    left.time_limit = options_.time_limit - seconds();
    if (options_.progress)
      left.progress = [this, before = sum_.iterations](Progress p) {
        p.iteration += before;
        p.seconds = seconds();
        options_.progress(p);
      };
    return left;
  }
  bool over(Status last) const {
    return last == Status::interrupted || last == Status::time_limit || last == Status::unsupported ||
           sum_.iterations >= options_.max_iterations;
  }
  /// The sums so far, in a summary of the last solve.
  const Summary& add(Summary s, double initial_cost) {
    s.initial_cost = initial_cost;
    s.iterations += sum_.iterations;
    s.evaluations += sum_.evaluations;
    s.evaluation_seconds += sum_.evaluation_seconds;
    s.linear_solver_seconds += sum_.linear_solver_seconds;
    s.seconds = seconds();
    return sum_ = std::move(s);
  }

 private:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

  const SolverOptions& options_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  Summary sum_;
};

}  // namespace

Summary graduate(Problem& problem, const SolverOptions& options, const GraduationOptions& graduation,
                 const SolveOnce& solve) {
  if (!(graduation.divide > 1) || !(graduation.tolerance >= 0))
    throw Error("graduation: divide must be above 1, and the tolerance not negative");
  double initial_cost = 0;
  std::optional<double> convex;
  try {
    initial_cost = Program(problem).cost();
    convex = problem.convex_widening();
  } catch (const Error&) {  // nothing to solve, or undefined at the start: the solver says which
  }
  if (!convex) return solve(options, 0.0);

  Sequence sequence(options);
  {
    const KeepWidening keep(problem);
    const double original = problem.widening();
    double widening = kLeastSquares * std::max(original, *convex);
    for (bool over = false; !over && widening > original;) {
      problem.widen_losses(widening);
      over = sequence.over(sequence.add(solve(sequence.limits(), graduation.tolerance), initial_cost).status);
      widening = std::min(widening / std::sqrt(graduation.divide), problem.convex_widening().value_or(0.0));
    }
  }
  return sequence.add(solve(sequence.limits(), 0.0), initial_cost);
}

}  // namespace tandem::detail
