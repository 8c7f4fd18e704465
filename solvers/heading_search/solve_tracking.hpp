#pragma once

#include <cmath>
#include <concepts>
#include <utility>

#include <tandem/problem/stop.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/graduated.hpp>
#include <tandem/solvers/sequence.hpp>

namespace tandem {

/// Result of search_headings().
struct HeadingSearch {
  int gaps = 0, improved = 0;  ///< gaps that were searched, and those with an improvement
  double gain = 0;             ///< total decrease of the cost
  bool cut_short = false;      ///< true if some gaps were not searched
};

/// Searches for better headings in gaps of more than 10 s without an orientation measurement, where a solution may be
/// in a poor local minimum.
///
/// The problem must have been solved. Each gap is solved by itself from the candidates of
/// solvers/heading_search/heading_starts.hpp, then with turns at slow moments (solvers/heading_search/slow_turns.hpp),
/// and keeps the best result. If a gap has improved, solve the whole problem again.
HeadingSearch search_headings(TrackingProblem& tracking, const Stop& stop = {});

namespace detail {
/// Adds the range of the target to the unobservable states of a converged solve if only bearings are measured, and they
/// do not determine it.
void report_range(TrackingProblem& tracking, const Stop& stop, Summary& summary);
}  // namespace detail

/// Solves a tracking problem, searches for better headings, and solves again if a gap has improved.
///
/// With `graduated`, the first solve is solve_graduated(). The summary is that of the last solve. Its iterations and
/// times are sums over all solves of the whole problem. Limits apply to all solves together, including the search. If
/// the search is cut short, the status is `time_limit` or `interrupted`.
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
  const auto with_range = [&](Summary summary) {
    detail::report_range(tracking, stop, summary);
    return summary;
  };
  const bool solved = (first.converged() || first.status == Status::failed) && std::isfinite(first.cost);
  if (!solved || sequence.is_over(first.status)) return with_range(std::move(sum));
  const HeadingSearch search = search_headings(tracking, stop);
  if (search.improved > 0) return with_range(sequence.add(solve(tracking.problem, limited()), first.initial_cost));
  sum.seconds = sequence.seconds();
  if (search.cut_short) {
    sum.status = stop.interrupted() ? Status::interrupted : Status::time_limit;
    sum.message = "some heading gaps were not searched";
  }
  return with_range(std::move(sum));
}

}  // namespace tandem
