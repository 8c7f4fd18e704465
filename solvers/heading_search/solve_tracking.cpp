#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include <tandem/lie/error.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/heading_search/heading_starts.hpp>
#include <tandem/solvers/heading_search/range_observability.hpp>
#include <tandem/solvers/heading_search/slow_turns.hpp>
#include <tandem/solvers/heading_search/solve_tracking.hpp>
#include <tandem/solvers/multistart.hpp>

namespace tandem {
namespace {

constexpr double kMinGap = 10.0;           // [s]; a vessel does not reverse its heading in shorter gaps.
constexpr std::size_t kMargin = 12;        // Keyframes on both sides of a gap that are solved with it.
constexpr double kMinRelativeGain = 1e-7;  // Minimum decrease, relative to the cost of the whole problem.
constexpr double kReturnAngle = 0.2;       // [rad]; a trial this close to the solution is abandoned.
// Headings that differ from a solution by less than a right angle at each keyframe lead back to it. No exception is
// known.
constexpr double kSameBasin = 0.5 * std::numbers::pi;
// Limits of the excess cost of a trial. A trial may rest near a saddle: some successful ones exceed the best cost by 5
// for ten iterations and decrease by only 0.005 per iteration. The limits do not depend on the problem size, because a
// cost is a negative log probability.
constexpr double kCostMargin = 2.0, kPatience = 2000;
constexpr int kTrialIterations = 150;

/// Returns candidate headings that may lead to another minimum than the present solution.
std::vector<std::vector<double>> other_headings(const TrackingProblem& tracking, const HeadingGap& gap) {
  std::vector<std::vector<double>> known = {headings(tracking, gap)};
  // Skips the reversed course if the solution follows the course. A target that goes astern is covered by the
  // interpolated headings.
  const bool ahead = fraction_aligned(known[0], candidate_headings(tracking, gap, HeadingCandidate::course)) > 0.5;
  for (const HeadingCandidate candidate : heading_candidates) {
    if (candidate == HeadingCandidate::reversed && ahead) continue;
    std::vector<double> along = candidate_headings(tracking, gap, candidate);
    const auto same = [&](const auto& other) { return max_heading_difference(other, along) < kSameBasin; };
    if (std::none_of(known.begin(), known.end(), same)) known.push_back(std::move(along));
  }
  known.erase(known.begin());
  return known;
}

}  // namespace

HeadingSearch search_headings(TrackingProblem& tracking, const Stop& stop) {
  HeadingSearch search;
  const std::vector<HeadingGap> gaps = heading_gaps(tracking, kMinGap);
  if (gaps.empty()) return search;
  MultistartOptions options;
  options.min_gain = kMinRelativeGain * NlpEvaluator(tracking.problem).cost();
  options.cost_margin = kCostMargin;
  options.patience = kPatience;
  options.max_iterations = kTrialIterations;
  options.stop = stop;
  // With odometry, the chaser is hardly affected by the target's headings, and a trial without it takes half the time.
  // This does not hold for a chaser with its own sensors.
  const bool with_chaser = !tracking.ego.empty();
  for (const HeadingGap& gap : gaps) {
    search.cut_short = stop.reached();
    if (search.cut_short) break;
    std::vector<std::function<void()>> starts;
    for (const std::vector<double>& along : other_headings(tracking, gap))
      starts.push_back([&tracking, &gap, along] { set_headings(tracking, gap, along); });
    ++search.gaps;
    options.has_returned = [&, solved = headings(tracking, gap)] {
      return max_heading_difference(solved, headings(tracking, gap)) <= kReturnAngle;
    };
    const auto ids = gap_variables(tracking, gap, kMargin, with_chaser);
    const auto outcome = solve_part_from(starts, tracking.problem, ids, options);
    const MultistartOutcome turns = add_slow_turns(tracking, gap, ids, with_chaser, options);
    search.improved += outcome.best >= 0 || turns.best >= 0;
    search.gain += outcome.gain + turns.gain;
  }
  search.cut_short |= stop.reached();
  return search;
}

void detail::report_range(TrackingProblem& tracking, const Stop& stop, Summary& summary) {
  if (!tracking.assumed_range || !summary.converged()) return;
  try {
    if (range_is_observable(tracking, Marginals(tracking.problem, {}, stop))) return;
  } catch (const Error&) {  // no covariances, or stopped
  }
  summary.unobservable.push_back({"target", {"range, which is assumed because only bearings are measured"}});
}

}  // namespace tandem
