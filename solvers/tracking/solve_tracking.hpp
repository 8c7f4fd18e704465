#pragma once

#include <cmath>
#include <concepts>

#include <tandem/problem/stop.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/graduated.hpp>
#include <tandem/solvers/sequence.hpp>

namespace tandem {

/// What trying other headings gave.
struct HeadingTrials {
  int gaps = 0, gained = 0;  ///< tried, and where another heading cost less
  double gain = 0;           ///< of cost, all gaps together
  bool cut_short = false;    ///< gaps are left that were not tried
};

/// Where no measurement tells the target's heading for long, a solution may be in a poorer basin. Of a problem that has
/// been solved: tries each such gap by itself with the headings of solvers/tracking/heading_starts.hpp and leaves what
/// costs least. The gaps' values are no solution of the whole then: solve it once more where something was gained.
HeadingTrials try_headings(TrackingProblem& tracking, const Stop& stop = {});

/// solve() or, if `graduated`, solve_graduated() of the whole, other headings in its gaps, and solve() once more where one
/// of them cost less. The summary is the last solve's, with iterations and times of the whole's solves added up; limits
/// hold for them together, trials included: where these were cut short, the status says so.
template <std::derived_from<SolverOptions> Options>
Summary solve_tracking(TrackingProblem& tracking, const Options& options, bool graduated = false) {
  const Stop stop(options);
  detail::Sequence sequence(options);
  const auto limited = [&] {
    Options o = options;
    static_cast<SolverOptions&>(o) = sequence.limits();
    return o;
  };
  const Summary first = graduated ? solve_graduated(tracking.problem, limited()) : solve(tracking.problem, limited());
  Summary sum = sequence.add(first, first.initial_cost);
  const bool solved = (first.converged() || first.status == Status::failed) && std::isfinite(first.cost);
  if (!solved || sequence.over(first.status)) return sum;
  const HeadingTrials trials = try_headings(tracking, stop);
  if (trials.gained > 0) return sequence.add(solve(tracking.problem, limited()), first.initial_cost);
  sum.seconds = sequence.seconds();
  if (trials.cut_short) {
    sum.status = stop.interrupted() ? Status::interrupted : Status::time_limit;
    sum.message = "other headings were not tried in all gaps";
  }
  return sum;
}

}  // namespace tandem
