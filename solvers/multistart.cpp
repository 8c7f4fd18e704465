#include <algorithm>
#include <array>

#include <tandem/problem/program.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/multistart.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {
namespace {

/// Whether a trial is worth its next iteration.
class Prospects {
 public:
  Prospects(const MultistartOptions& options, double best) : options_(options), best_(best) { costs_.fill(HUGE_VAL); }

  bool hopeless(const Progress& p) {
    const double decrease = (costs_[0] - p.cost) / double(costs_.size());  // of an iteration, in the last few
    std::rotate(costs_.begin(), costs_.begin() + 1, costs_.end());
    costs_.back() = p.cost;
    const double lacking = p.cost - best_;
    return lacking > options_.near && lacking > options_.patience * decrease;
  }

 private:
  const MultistartOptions& options_;
  double best_;
  std::array<double, 3> costs_;
};

template <class Options>
Summary solve_trial_with(Problem& part, const std::atomic<bool>& stop, std::function<void(const Progress&)> progress) {
  Options options;
  options.stop = &stop;
  options.progress = std::move(progress);
  return solve(part, options);
}

}  // namespace

MultistartOutcome solve_part_from(std::span<const std::function<void()>> starts, Problem& problem,
                                  std::span<const int> variable_ids, const MultistartOptions& options) {
  ProblemPart trial(problem, variable_ids), best(problem, variable_ids);
  if (!detail::why_unsolvable(best.problem()).empty()) return {};
  const double at_first = Program(best.problem()).cost();
  double lowest = at_first;
  MultistartOutcome outcome;
  for (std::size_t i = 0; i < starts.size() && !options.stop.reached(); ++i) {
    starts[i]();
    trial.take_values();
    std::atomic<bool> stop = false;
    Prospects prospects(options, lowest);
    const auto judge = [&](const Progress& p) {
      if (options.back) trial.give_values();
      stop = options.stop.reached() || prospects.hopeless(p) || (options.back && options.back());
    };
    const Summary s = trial.problem().num_hard_blocks() > 0
                          ? solve_trial_with<AugmentedLagrangianOptions>(trial.problem(), stop, judge)
                          : solve_trial_with<GaussNewtonOptions>(trial.problem(), stop, judge);
    outcome.iterations += s.iterations;
    outcome.evaluations += s.evaluations;
    if (s.converged() && s.cost < lowest - options.least_gain) {
      lowest = s.cost;
      outcome.best = static_cast<int>(i);
      trial.give_values();
      best.take_values();
    } else {
      best.give_values();
    }
  }
  outcome.gain = at_first - lowest;
  return outcome;
}

}  // namespace tandem
