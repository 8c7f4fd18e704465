#pragma once

#include <complex>
#include <vector>

#include <tandem/problem/tracking/track_smoother.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem::detail {

/// Preferences of the motion model for the heading of a target that hardly moves.
///
/// The model charges an acceleration a along body axes: ½ dt aᵀ R diag(1/σ²) Rᵀ a. If σ differs between surge and sway,
/// the cost depends on the heading ψ as −|s| cos(2ψ − arg s). It is least if the axis of the larger σ lies along a. A
/// non-holonomic constraint charges the velocity across the heading in the same form. These terms and the prior on the
/// yaw rate are all that determines such a heading.
struct HeadingAxes {
  std::vector<std::complex<double>> axis;  ///< s at each keyframe; empty if the cost does not depend on the heading
  double sway_sigma = 0, yaw_sigma = 0;    ///< motion noise [m s^-3/2, rad s^-3/2]
  bool non_holonomic = false;
};

/// Returns the axes at the keyframes, from the accelerations and velocities of the smoothed track.
HeadingAxes heading_axes(const std::vector<Keyframe>& keyframes, const SmoothedTrack& track, const TrackingNoise& noise,
                         const TrackingOptions& options);

/// Returns the headings [rad] that the axes suggest for the keyframes first … end − 1; empty if they suggest none.
/// `before` and `after` are the headings at the adjacent keyframes, which must be given if these exist.
///
/// The axes are summed over the time in which the prior on the yaw rate lets the heading follow them: for a gain κ per
/// second, variations of angular frequency w are worth their cost if w⁴ < 4 κ σ_yaw². At a speed v they also cost about
/// ½ (v w / σ_sway)² per second. Axes that lose by this are not used, nor those of a short interval. A half turn that
/// the adjacent headings require takes place where the axes are weakest.
std::vector<double> follow_axes(const std::vector<Keyframe>& keyframes, const SmoothedTrack& track,
                                const HeadingAxes& axes, std::size_t first, std::size_t end, double before,
                                double after);

}  // namespace tandem::detail
