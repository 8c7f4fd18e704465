#include <cmath>

#include <tandem/problem/program.hpp>
#include <tandem/solvers/graduated.hpp>
#include <tandem/solvers/sequence.hpp>

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
