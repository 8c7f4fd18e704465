#pragma once

#include <span>
#include <vector>

#include <tandem/solvers/heading_search/heading_starts.hpp>
#include <tandem/solvers/multistart.hpp>

namespace tandem {

/// A turn by some half turns that is added to the headings of a gap while the target is slow.
///
/// After an odd number of half turns, the target goes astern instead of ahead. The motion models are symmetric in this
/// respect, so only the turn itself changes the cost, and it changes little at low speed.
struct SlowTurn {
  int half_turns;
  double cost;                 ///< change of the cost if all later headings of the gap turn as well
  HeadingGap stretch;          ///< keyframes during which the target turns
  std::vector<double> angles;  ///< added to the headings of the stretch [rad]
};

/// Returns the keyframes of a gap at which the speed over ground has a local minimum below 0.3 times the highest speed
/// in the gap.
std::vector<std::size_t> slow_keyframes(const TrackingProblem& tracking, const HeadingGap& gap);

/// Returns the least costly combination of turns whose stretches do not overlap, in order of time.
///
/// `turns` has the possible turns of slow keyframes, in order of time: at least one per keyframe, all with the same
/// stretch. With `even`, the sum of the half turns is even, as the measured headings around a gap require.
std::vector<const SlowTurn*> best_turns(std::span<const std::vector<SlowTurn>> turns, bool even);

/// Adds turns at the slow keyframes of a solved gap as long as they decrease the cost.
///
/// Each turn is first solved by itself in a short stretch. The least costly combination is then solved in the whole
/// gap, whose variables are `ids`, and kept if it is better. The limits of `options` apply to the latter.
MultistartOutcome add_slow_turns(TrackingProblem& tracking, const HeadingGap& gap, std::span<const int> ids,
                                 bool with_chaser, MultistartOptions options);

}  // namespace tandem
