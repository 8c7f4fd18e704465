#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include <tandem/problem/program.hpp>
#include <tandem/solvers/multistart.hpp>
#include <tandem/solvers/tracking/heading_starts.hpp>
#include <tandem/solvers/tracking/solve_tracking.hpp>

namespace tandem {
namespace {

constexpr double kShortestGap = 10.0;  // s; in less no vessel turns round unseen
constexpr std::size_t kMargin = 12;    // keyframes on both sides that a gap is solved with
constexpr double kLeastGain = 1e-7;    // of the whole's cost
constexpr double kBack = 0.2;          // rad: a trial this near to the solution is on its way there
// Headings that nowhere differ by a right angle from those of a solution lead to it, as far as any was tried (220 times).
constexpr double kSameBasin = 0.5 * std::numbers::pi;
// A cost is minus the logarithm of a probability, whatever the size of the problem. Trials rest at saddles: some that end
// lower are for ten iterations by 5 above, and come closer by a thousandth of that in one.
constexpr double kNear = 2.0, kPatience = 2000;
constexpr int kTrialIterations = 150;

/// Headings to start from that may lead to another minimum than the one that the problem is at.
std::vector<std::vector<double>> other_headings(const TrackingProblem& tracking, const HeadingGap& gap) {
  std::vector<std::vector<double>> known = {headings(tracking, gap)};
  // Against the course only where the solution does not go along it: the target would go astern, which interpolated
  // headings show where those around the gap do.
  const bool ahead = share_alike(known[0], headings_by(tracking, gap, HeadingWay::course)) > 0.5;
  for (const HeadingWay way : heading_ways) {
    if (way == HeadingWay::reversed && ahead) continue;
    std::vector<double> along = headings_by(tracking, gap, way);
    const auto same = [&](const auto& other) { return largest_turn(other, along) < kSameBasin; };
    if (std::none_of(known.begin(), known.end(), same)) known.push_back(std::move(along));
  }
  known.erase(known.begin());
  return known;
}

}  // namespace

HeadingTrials try_headings(TrackingProblem& tracking, const Stop& stop) {
  HeadingTrials trials;
  const std::vector<HeadingGap> gaps = heading_gaps(tracking, kShortestGap);
  if (gaps.empty()) return trials;
  MultistartOptions options;
  options.least_gain = kLeastGain * Program(tracking.problem).cost();
  options.near = kNear;
  options.patience = kPatience;
  options.max_iterations = kTrialIterations;
  options.stop = stop;
  // Odometry ties the chaser so well that it hardly moves with the target's headings, and a trial without it takes half
  // the time. Its own sensors may not.
  const bool with_chaser = !tracking.ego.empty();
  for (const HeadingGap& gap : gaps) {
    trials.cut_short = stop.reached();
    if (trials.cut_short) break;
    std::vector<std::function<void()>> starts;
    for (const std::vector<double>& along : other_headings(tracking, gap))
      starts.push_back([&tracking, &gap, along] { set_headings(tracking, gap, along); });
    ++trials.gaps;
    if (starts.empty()) continue;
    options.back = [&, solved = headings(tracking, gap)] {
      return largest_turn(solved, headings(tracking, gap)) <= kBack;
    };
    const auto ids = gap_variables(tracking, gap, kMargin, with_chaser);
    const auto outcome = solve_part_from(starts, tracking.problem, ids, options);
    trials.gained += outcome.best >= 0;
    trials.gain += outcome.gain;
  }
  trials.cut_short |= stop.reached();
  return trials;
}

}  // namespace tandem
