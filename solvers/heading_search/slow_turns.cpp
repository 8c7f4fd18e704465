#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include <tandem/lie/wrapped_angle.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/heading_search/slow_turns.hpp>

namespace tandem {
namespace {

constexpr double kSlow = 0.3;            // Slow speeds, relative to the highest speed in the gap.
constexpr double kSeparation = 4.0;      // [s]; the slowest of several keyframes this close represents them.
constexpr double kReach = 26.0;          // [s]; duration of a stretch before and after its slow keyframe.
constexpr double kTurnTime = 24.0;       // [s]; duration of a turn before it is solved.
constexpr std::size_t kNeighbours = 12;  // Keyframes after a stretch that may share a residual with it.
// Turns that cost more are of no use: few others decrease the cost by more than that.
constexpr double kMaxCost = 0.3;
// Most trials cost too much, so each is abandoned early. A wrong decision loses one turn at most.
constexpr double kTurnPatience = 6;
constexpr int kTurnIterations = 60, kRounds = 8;
// Cost of a half turn above which the whole turn in the same direction is not tried. As the cost is roughly quadratic in
// the angle, it would be higher.
constexpr double kMaxHalfTurnCost = 2.0;

double speed(const TrackingProblem& tracking, std::size_t k) {
  const Vector<3> moved = tracking.target_state(k + 1).position - tracking.target_state(k).position;
  return moved.head<2>().norm() / (tracking.keyframes[k + 1].t - tracking.keyframes[k].t);
}

/// Returns the keyframes of a gap within `duration` seconds of keyframe k.
HeadingGap around(const TrackingProblem& tracking, const HeadingGap& gap, std::size_t k, double duration) {
  const std::vector<Keyframe>& keyframes = tracking.keyframes;
  HeadingGap found{k, k};
  while (found.first > gap.first && keyframes[k].t - keyframes[found.first - 1].t <= duration) --found.first;
  while (found.last < gap.last && keyframes[found.last + 1].t - keyframes[k].t <= duration) ++found.last;
  return found;
}

/// Returns the turns at a slow keyframe that cost at most kMaxCost. The values of the problem are unchanged.
std::vector<SlowTurn> turns_at(TrackingProblem& tracking, std::size_t slow, const HeadingGap& stretch, bool with_chaser,
                               const MultistartOptions& options) {
  const HeadingGap turned{stretch.first, std::min(stretch.last + kNeighbours, tracking.keyframes.size() - 1)};
  Subproblem original(tracking.problem, gap_variables(tracking, turned, 0, with_chaser));
  Subproblem part(tracking.problem, gap_variables(tracking, stretch, 0, with_chaser));
  const double present = NlpEvaluator(part.problem()).cost();
  const std::vector<double> before = headings(tracking, stretch);
  std::vector<SlowTurn> turns;
  const auto try_turn = [&](int half_turns) {
    const double angle = half_turns * std::numbers::pi;
    std::vector<double> angles;
    for (std::size_t k = turned.first; k <= turned.last; ++k) {
      const double since = tracking.keyframes[k].t - tracking.keyframes[slow].t;
      angles.push_back(k > stretch.last ? angle : angle * std::clamp(0.5 + since / kTurnTime, 0.0, 1.0));
    }
    turn(tracking, turned, angles);
    part.update_from_whole();
    original.write_back();
    const Trial trial = solve_trial(part, present + kMaxCost, options);
    if (trial.completed && trial.cost < present + kMaxCost) {
      part.write_back();
      const std::vector<double> after = headings(tracking, stretch);
      original.write_back();
      double last = 0;
      for (std::size_t i = 0; i < after.size(); ++i) angles[i] = last += wrapped_angle(after[i] - before[i] - last);
      angles.resize(after.size());
      const bool kept = std::abs(angles.front()) < 1 && std::abs(angle - last) < 1;  // The solve may undo whole turns.
      if (kept) turns.push_back({half_turns, trial.cost - present, stretch, std::move(angles)});
    }
    return trial.cost - present;
  };
  const double left = try_turn(1), right = try_turn(-1);
  if (std::min(left, right) < kMaxHalfTurnCost) try_turn(left < right ? 2 : -2);
  return turns;
}

/// Adds turns, which are in order of time, to the headings of a gap.
void add_turns(TrackingProblem& tracking, const HeadingGap& gap, std::span<const SlowTurn* const> turns) {
  std::vector<double> angles(gap.last - gap.first + 1);
  double sum = 0;
  for (const SlowTurn* t : turns) {
    const auto at = angles.begin() + std::ptrdiff_t(t->stretch.first - gap.first);
    const auto end = std::transform(t->angles.begin(), t->angles.end(), at, [&](double angle) { return sum + angle; });
    sum += t->half_turns * std::numbers::pi;
    std::fill(end, angles.end(), sum);
  }
  // At the start of a recording, the headings before the turns are free and those after them are not.
  if (gap.first == 0)
    for (double& angle : angles) angle -= sum;
  turn(tracking, gap, angles);
}

}  // namespace

std::vector<std::size_t> slow_keyframes(const TrackingProblem& tracking, const HeadingGap& gap) {
  std::map<std::size_t, double> speeds;
  double highest = 0;
  for (std::size_t k = gap.first; k <= gap.last && k + 1 < tracking.keyframes.size(); ++k)
    highest = std::max(highest, speeds[k] = speed(tracking, k));
  std::vector<std::size_t> slow;
  for (const auto& [k, v] : speeds) {
    if (v >= kSlow * highest) continue;
    const HeadingGap near = around(tracking, {gap.first, speeds.rbegin()->first}, k, kSeparation);
    bool slowest = true;
    for (std::size_t i = near.first; i <= near.last; ++i) slowest &= v < speeds[i] || (v == speeds[i] && k <= i);
    if (slowest) slow.push_back(k);
  }
  return slow;
}

std::vector<const SlowTurn*> best_turns(std::span<const std::vector<SlowTurn>> turns, bool even) {
  struct Choice {
    double cost = HUGE_VAL;
    std::vector<const SlowTurn*> turns{};
  };
  // Dynamic programming. best[i][p] is the best choice among the first i keyframes whose sum of half turns has parity p.
  std::vector<std::array<Choice, 2>> best{{Choice{0}, Choice{}}};
  for (std::size_t i = 0; i < turns.size(); ++i) {
    best.push_back(best[i]);
    for (const SlowTurn& t : turns[i]) {
      std::size_t earlier = i;
      while (earlier > 0 && turns[earlier - 1][0].stretch.last >= t.stretch.first) --earlier;
      for (const int parity : {0, 1}) {
        const Choice& from = best[earlier][std::size_t(parity)];
        Choice& to = best[i + 1][std::size_t((parity + t.half_turns) & 1)];
        if (from.cost + t.cost >= to.cost) continue;
        to = {from.cost + t.cost, from.turns};
        to.turns.push_back(&t);
      }
    }
  }
  const auto& [evenly, oddly] = best.back();
  return even || evenly.cost <= oddly.cost ? evenly.turns : oddly.turns;
}

MultistartOutcome add_slow_turns(TrackingProblem& tracking, const HeadingGap& gap, std::span<const int> ids,
                                 bool with_chaser, MultistartOptions options) {
  options.has_returned = {};
  MultistartOptions local = options;
  local.cost_margin = 0;
  local.patience = kTurnPatience;
  local.max_iterations = kTurnIterations;
  const bool even = gap.first > 0 && gap.last + 1 < tracking.keyframes.size();
  struct Found {
    HeadingGap stretch;
    std::vector<SlowTurn> turns;
  };
  std::map<std::size_t, Found> found;  // by slow keyframe
  MultistartOutcome sum;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::vector<SlowTurn>> turns;
    for (const std::size_t k : slow_keyframes(tracking, gap)) {
      if (options.stop.reached()) return sum;
      if (!found.contains(k)) {
        const HeadingGap stretch = around(tracking, gap, k, kReach);
        found[k] = {stretch, turns_at(tracking, k, stretch, with_chaser, local)};
      }
      if (!found[k].turns.empty()) turns.push_back(found[k].turns);
    }
    const std::vector<const SlowTurn*> best = best_turns(turns, even);
    if (best.empty()) break;
    const std::function<void()> start = [&] { add_turns(tracking, gap, best); };
    const MultistartOutcome outcome = solve_part_from({&start, 1}, tracking.problem, ids, options);
    if (outcome.best < 0) break;
    sum.best = 0;
    sum.gain += outcome.gain;
    std::erase_if(found, [&](const auto& keyframe_and_found) {
      const HeadingGap& stretch = keyframe_and_found.second.stretch;
      return std::any_of(best.begin(), best.end(), [&](const SlowTurn* t) {
        return t->stretch.first <= stretch.last && stretch.first <= t->stretch.last;
      });
    });
  }
  return sum;
}

}  // namespace tandem
