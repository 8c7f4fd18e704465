#pragma once

#include <array>
#include <vector>

#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem {

/// How headings of a target may run where nothing measures them.
enum class HeadingWay {
  course,        ///< along the way that the positions make
  reversed,      ///< against it
  shorter_turn,  ///< from the last heading before to the first one after, evenly
  longer_turn,   ///< the other way round
};
inline constexpr std::array heading_ways = {HeadingWay::course, HeadingWay::reversed, HeadingWay::shorter_turn,
                                            HeadingWay::longer_turn};

/// A stretch of keyframes at which the target is a pose that is not fixed, but no measurement tells its orientation, as long
/// as such a stretch goes.
struct HeadingGap {
  std::size_t first, last;  ///< keyframes
};
/// Those of more than `least` seconds between the orientations around them, in order.
std::vector<HeadingGap> heading_gaps(const TrackingProblem& tracking, double least);

/// Ids of the variables of the target, and with `chaser` of the chaser too, over the gap and `margin` keyframes more on
/// both sides.
std::vector<int> gap_variables(const TrackingProblem& tracking, const HeadingGap& gap, std::size_t margin, bool chaser);

/// The target's headings over a gap, and those of a way from its positions and the headings around [rad]. At an end of
/// the recording there is one heading to turn from, which both turns then keep.
std::vector<double> headings(const TrackingProblem& tracking, const HeadingGap& gap);
std::vector<double> headings_by(const TrackingProblem& tracking, const HeadingGap& gap, HeadingWay way);
/// Turns the target over a gap to these headings, level; positions stay.
void set_headings(TrackingProblem& tracking, const HeadingGap& gap, const std::vector<double>& headings);

/// The largest angle between headings of the same gap [rad].
double largest_turn(const std::vector<double>& a, const std::vector<double>& b);
/// The part of them that are nearer than a right angle.
double share_alike(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace tandem
