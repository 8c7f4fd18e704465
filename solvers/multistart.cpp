#include <algorithm>
#include <array>
#include <cmath>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/multistart.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {
namespace {

struct Merit {
  double cost, violation;

  bool feasible() const { return violation <= detail::kConstraintTolerance; }
};

Merit merit_of(Problem& part) {
  NlpEvaluator nlp(part);
  Eigen::VectorXd rows(nlp.num_rows());
  nlp.constraints(rows);
  const bool met = detail::violated_row(nlp, rows, detail::kConstraintTolerance) < 0;
  return {nlp.cost(), met ? 0.0 : nlp.violation(rows).size};
}

/// Decides whether to continue a trial.
class TrialProgress {
 public:
  TrialProgress(const MultistartOptions& options, const Merit& best) : options_(options), best_(best) {
    recent_.fill({HUGE_VAL, HUGE_VAL});
  }

  bool should_abandon(const Progress& p) {
    const Merit before = recent_[0], now{p.cost, p.violation};
    std::rotate(recent_.begin(), recent_.begin() + 1, recent_.end());
    recent_.back() = now;
    if (!best_.feasible() || (!now.feasible() && now.violation < 0.5 * before.violation)) return false;
    const double excess = now.cost - best_.cost;
    const double decrease = (before.cost - now.cost) / double(recent_.size());  // per iteration
    return excess > options_.cost_margin && excess > options_.patience * decrease;
  }

 private:
  const MultistartOptions& options_;
  Merit best_;
  std::array<Merit, 3> recent_;
};

template <class Options>
Summary solve_with(const SolverOptions& limits, Problem& part) {
  Options options;
  static_cast<SolverOptions&>(options) = limits;
  return solve(part, options);
}

/// Solves from the values of the trial until it converges or is abandoned.
Summary run_trial(Subproblem& trial, const Merit& best, const MultistartOptions& options) {
  std::atomic<bool> stop = false;
  TrialProgress trial_progress(options, best);
  SolverOptions limits;
  limits.max_iterations = options.max_iterations;
  limits.stop = &stop;
  limits.observability = false;
  limits.progress = [&](const Progress& p) {
    if (options.has_returned) trial.write_back();
    stop =
        options.stop.reached() || trial_progress.should_abandon(p) || (options.has_returned && options.has_returned());
  };
  return trial.problem().num_hard_blocks() > 0 ? solve_with<AugmentedLagrangianOptions>(limits, trial.problem())
                                               : solve_with<GaussNewtonOptions>(limits, trial.problem());
}

}  // namespace

Trial solve_trial(Subproblem& part, double best, const MultistartOptions& options) {
  const Summary s = run_trial(part, {best, 0}, options);
  const bool feasible = s.worst_constraint.empty() || s.max_violation <= detail::kConstraintTolerance;
  return {s.cost, s.status != Status::interrupted && std::isfinite(s.cost) && feasible};
}

MultistartOutcome solve_part_from(std::span<const std::function<void()>> starts, Problem& problem,
                                  std::span<const int> variable_ids, const MultistartOptions& options) {
  Subproblem trial(problem, variable_ids), best(problem, variable_ids);
  if (!detail::why_unsolvable(best.problem()).empty()) return {};
  const Merit first = merit_of(best.problem());
  Merit lowest = first;
  MultistartOutcome outcome;
  try {
    for (std::size_t i = 0; i < starts.size() && !options.stop.reached(); ++i) {
      starts[i]();
      trial.update_from_whole();
      const Summary s = run_trial(trial, lowest, options);
      outcome.iterations += s.iterations;
      outcome.evaluations += s.evaluations;
      const Merit reached{s.cost, s.worst_constraint.empty() ? 0.0 : s.max_violation};
      const bool better = !lowest.feasible() || reached.cost < lowest.cost - options.min_gain;
      if (s.status != Status::interrupted && std::isfinite(s.cost) && reached.feasible() && better) {
        lowest = reached;
        outcome.best = static_cast<int>(i);
        trial.write_back();
        best.update_from_whole();
      } else {
        best.write_back();
      }
    }
  } catch (...) {
    best.write_back();
    throw;
  }
  outcome.gain = first.cost - lowest.cost;
  return outcome;
}

}  // namespace tandem
