#include <algorithm>
#include <array>
#include <cmath>

#include <tandem/problem/program.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/multistart.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {
namespace {

/// What values of a part are judged by.
struct Merit {
  double cost, violation;

  bool feasible() const { return violation <= detail::kConstraintTolerance; }
};

Merit merit_of(Problem& part) {
  Program program(part);
  Eigen::VectorXd rows(program.num_rows());
  program.constraints(rows);
  return {program.cost(), program.violation(rows).size};
}

/// Whether a trial is worth its next iteration.
class Prospects {
 public:
  Prospects(const MultistartOptions& options, const Merit& best) : options_(options), best_(best) {
    recent_.fill({HUGE_VAL, HUGE_VAL});
  }

  bool hopeless(const Progress& p) {
    const Merit before = recent_[0], now{p.cost, p.violation};
    std::rotate(recent_.begin(), recent_.begin() + 1, recent_.end());
    recent_.back() = now;
    if (!best_.feasible() || (!now.feasible() && now.violation < 0.5 * before.violation)) return false;
    const double lacking = now.cost - best_.cost;
    const double decrease = (before.cost - now.cost) / double(recent_.size());  // in one iteration
    return lacking > options_.near && lacking > options_.patience * decrease;
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

/// Solves from where the trial is, for as long as that is worth it.
Summary solve_trial(ProblemPart& trial, const Merit& best, const MultistartOptions& options) {
  std::atomic<bool> stop = false;
  Prospects prospects(options, best);
  SolverOptions limits;
  limits.max_iterations = options.max_iterations;
  limits.stop = &stop;
  limits.progress = [&](const Progress& p) {
    if (options.back) trial.give_values();
    stop = options.stop.reached() || prospects.hopeless(p) || (options.back && options.back());
  };
  return trial.problem().num_hard_blocks() > 0 ? solve_with<AugmentedLagrangianOptions>(limits, trial.problem())
                                               : solve_with<GaussNewtonOptions>(limits, trial.problem());
}

}  // namespace

MultistartOutcome solve_part_from(std::span<const std::function<void()>> starts, Problem& problem,
                                  std::span<const int> variable_ids, const MultistartOptions& options) {
  ProblemPart trial(problem, variable_ids), best(problem, variable_ids);
  if (!detail::why_unsolvable(best.problem()).empty()) return {};
  const Merit first = merit_of(best.problem());
  Merit lowest = first;
  MultistartOutcome outcome;
  try {
    for (std::size_t i = 0; i < starts.size() && !options.stop.reached(); ++i) {
      starts[i]();
      trial.take_values();
      const Summary s = solve_trial(trial, lowest, options);
      outcome.iterations += s.iterations;
      outcome.evaluations += s.evaluations;
      const Merit reached{s.cost, s.max_violation};
      const bool better = !lowest.feasible() || reached.cost < lowest.cost - options.least_gain;
      if (s.status != Status::interrupted && std::isfinite(s.cost) && reached.feasible() && better) {
        lowest = reached;
        outcome.best = static_cast<int>(i);
        trial.give_values();
        best.take_values();
      } else {
        best.give_values();
      }
    }
  } catch (...) {
    best.give_values();
    throw;
  }
  outcome.gain = first.cost - lowest.cost;
  return outcome;
}

}  // namespace tandem
