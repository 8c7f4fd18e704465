#pragma once

#include <atomic>
#include <concepts>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/graduated.hpp>
#include <tandem/solvers/sequence.hpp>

namespace tandem {

/// What trying other headings gave.
struct HeadingTrials {
  int gaps = 0, gained = 0;  ///< tried, and where another heading cost less
  double gain = 0;           ///< of cost, all gaps together
};

/// Where no measurement tells the target's heading for long, a solution may be in a poorer basin. Of a problem that has
/// been solved: tries each such gap by itself with the headings of solvers/tracking/heading_starts.hpp and leaves what
/// costs least. The gaps' values are no solution of the whole then: solve it once more where something was gained.
HeadingTrials try_headings(TrackingProblem& tracking, const std::atomic<bool>* stop = nullptr);

/// solve() or, if `graduated`, solve_graduated() of the whole, other headings in its gaps, and solve() once more where one
/// of them cost less. The summary is the last solve's, with iterations and times of the whole's solves added up; limits
/// hold for them together. Trials take a quarter to a half of the first solve's time over hours, half to
/// nine tenths of it over 20 minutes, and nothing where there is no gap.
template <std::derived_from<SolverOptions> Options>
Summary solve_tracking(TrackingProblem& tracking, const Options& options, bool graduated = false) {
  detail::Sequence sequence(options);
  const auto limited = [&] {
    Options o = options;
    static_cast<SolverOptions&>(o) = sequence.limits();
    return o;
  };
  const Summary first = graduated ? solve_graduated(tracking.problem, limited()) : solve(tracking.problem, limited());
  Summary sum = sequence.add(first, first.initial_cost);
  const bool solved = first.converged() || first.status == Status::failed;
  if (!solved || sequence.over(first.status)) return sum;
  if (try_headings(tracking, options.stop).gained > 0)
    return sequence.add(solve(tracking.problem, limited()), first.initial_cost);
  sum.seconds = sequence.seconds();
  return sum;
}

}  // namespace tandem
