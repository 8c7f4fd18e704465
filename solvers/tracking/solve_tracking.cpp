#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include <tandem/problem/program.hpp>
#include <tandem/solvers/multistart.hpp>
#include <tandem/solvers/tracking/heading_starts.hpp>
#include <tandem/solvers/tracking/solve_tracking.hpp>

namespace tandem {
namespace {

constexpr double kShortestGap = 10.0;  // s; in less no vessel turns round unseen
constexpr std::size_t kMargin = 12;    // keyframes on both sides that a gap is solved with
constexpr double kSameBasin = 0.2;     // rad: headings this near lead to the same minimum
constexpr double kLeastGain = 1e-7;    // of the whole's cost
constexpr double kNear = 1e-4;         // of it: headings that cost no more are followed to the end

}  // namespace

HeadingTrials try_headings(TrackingProblem& tracking, const Stop& stop) {
  HeadingTrials trials;
  const std::vector<HeadingGap> gaps = heading_gaps(tracking, kShortestGap);
  if (gaps.empty()) return trials;
  const double cost = Program(tracking.problem).cost();
  for (const HeadingGap& gap : gaps) {
    trials.cut_short = stop.reached();
    if (trials.cut_short) break;
    const std::vector<double> solved = headings(tracking, gap);
    std::vector<std::vector<double>> ways = {solved};
    std::vector<std::function<void()>> starts;
    for (const HeadingWay way : heading_ways) {
      const std::vector<double> along = headings_by(tracking, gap, way);
      const auto same = [&](const std::vector<double>& other) { return largest_turn(other, along) <= kSameBasin; };
      if (std::any_of(ways.begin(), ways.end(), same)) continue;
      ways.push_back(along);
      starts.push_back([&tracking, &gap, along] { set_headings(tracking, gap, along); });
    }
    MultistartOptions options;
    options.least_gain = kLeastGain * cost;
    options.near = kNear * cost;
    options.back = [&] { return largest_turn(solved, headings(tracking, gap)) <= kSameBasin; };
    options.stop = stop;
    const auto outcome = solve_part_from(starts, tracking.problem, gap_variables(tracking, gap, kMargin), options);
    ++trials.gaps;
    trials.gained += outcome.best >= 0;
    trials.gain += outcome.gain;
  }
  trials.cut_short |= stop.reached();
  return trials;
}

}  // namespace tandem
