#pragma once

#include <array>
#include <vector>

#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem {

/// Candidates for the headings of a target in a heading gap.
enum class HeadingCandidate {
  course,        ///< along the course over ground
  reversed,      ///< against the course
  shorter_turn,  ///< uniform turn between the headings around the gap
  longer_turn,   ///< uniform turn in the other direction
};
inline constexpr std::array heading_candidates = {HeadingCandidate::course, HeadingCandidate::reversed,
                                                  HeadingCandidate::shorter_turn, HeadingCandidate::longer_turn};

/// Longest possible sequence of keyframes at which the target is a free pose without an orientation measurement.
struct HeadingGap {
  std::size_t first, last;  ///< keyframe indices, both included
};
/// Returns the gaps whose bounding orientation measurements are more than `min_duration` seconds apart, in order of
/// time.
std::vector<HeadingGap> heading_gaps(const TrackingProblem& tracking, double min_duration);

/// Returns the ids of the target's variables from `margin` keyframes before to `margin` keyframes after the gap. With
/// `chaser`, also those of the chaser.
std::vector<int> gap_variables(const TrackingProblem& tracking, const HeadingGap& gap, std::size_t margin, bool chaser);

/// Returns the present headings of the target in a gap [rad].
std::vector<double> headings(const TrackingProblem& tracking, const HeadingGap& gap);
/// Returns candidate headings for a gap [rad], from the positions or from the headings around it. At an end of the
/// recording only one heading is known; both turns then keep it.
std::vector<double> candidate_headings(const TrackingProblem& tracking, const HeadingGap& gap,
                                       HeadingCandidate candidate);
/// Sets the target's orientations in a gap to these headings, with zero roll and pitch. Positions are unchanged.
void set_headings(TrackingProblem& tracking, const HeadingGap& gap, const std::vector<double>& headings);

/// Turns the target's free poses in a gap about their own vertical axes, by one angle per keyframe [rad], and their body
/// twists with them. Positions are unchanged.
void turn(TrackingProblem& tracking, const HeadingGap& gap, const std::vector<double>& angles);

/// Returns the largest angle between two sets of headings of one gap [rad].
double max_heading_difference(const std::vector<double>& a, const std::vector<double>& b);
/// Returns the fraction of keyframes at which the headings differ by less than 90°.
double fraction_aligned(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace tandem
