#include <cmath>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/graduated.hpp>
#include <tandem/solvers/sequence.hpp>

namespace tandem::detail {
namespace {

// with a scale this much larger than the residual, a loss is the identity to 1e-12
constexpr double kLeastSquares = 1e6;

/// Restores the loss scale of a problem at the end of a scope.
class LossScaleGuard {
 public:
  explicit LossScaleGuard(Problem& problem) : problem_(problem), loss_scale_(problem.loss_scale()) {}
  ~LossScaleGuard() { problem_.scale_losses(loss_scale_); }
  LossScaleGuard(const LossScaleGuard&) = delete;
  LossScaleGuard& operator=(const LossScaleGuard&) = delete;

 private:
  Problem& problem_;
  double loss_scale_;
};

}  // namespace

Summary graduate(Problem& problem, const SolverOptions& options, const GraduationOptions& graduation,
                 const SolveOnce& solve) {
  if (!(graduation.divide > 1) || !(graduation.tolerance >= 0))
    throw BadInputError(
        "solve_graduated: GraduationOptions::divide must be above 1, and tolerance must not be negative");
  double initial_cost = 0;
  std::optional<double> convex;
  if (problem.size().unknowns > 0) try {
      initial_cost = NlpEvaluator(problem).cost();
      convex = problem.convex_loss_scale();
    } catch (const UndefinedResidualError&) {  // the solver reports it
    }
  if (!convex) return solve(options, 0.0);

  Sequence sequence(options);
  {
    const LossScaleGuard keep(problem);
    const double original = problem.loss_scale();
    double loss_scale = kLeastSquares * std::max(original, *convex);
    for (bool over = false; !over && loss_scale > original;) {
      problem.scale_losses(loss_scale);
      over = sequence.is_over(sequence.add(solve(sequence.limits(), graduation.tolerance), initial_cost).status);
      loss_scale = std::min(loss_scale / std::sqrt(graduation.divide), problem.convex_loss_scale().value_or(0.0));
    }
  }
  return sequence.add(solve(sequence.limits(), 0.0), initial_cost);
}

}  // namespace tandem::detail
