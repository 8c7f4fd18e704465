#pragma once

#include <vector>

#include <tandem/problem/tracking/heading_axes.hpp>
#include <tandem/problem/tracking/keyframes.hpp>
#include <tandem/problem/tracking/track_smoother.hpp>
#include <tandem/problem/tracking/tracking_data.hpp>

namespace tandem::detail {

/// A measured orientation of the target.
struct OrientationFix {
  double t;  ///< s
  SO3 rotation;
};

/// Returns the measured orientations in order of time, for chaser poses at the keyframes.
std::vector<OrientationFix> measured_orientations(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                                  const std::vector<SE3>& chaser);

/// Returns the fixes that agree with the L1 medoid of their neighbourhood, the nearest nine fixes within `near` [s].
/// The medoid has the smallest sum of angles to the other orientations and, at half weight, to the directions of
/// travel. With half weight, the direction of travel resolves ties, but does not outvote measurements of a target that
/// drifts or goes astern.
std::vector<OrientationFix> consistent_fixes(const std::vector<OrientationFix>& fixes,
                                             const std::vector<Keyframe>& keyframes, const SmoothedTrack& track,
                                             double near);

/// Returns a level orientation whose x axis points along a horizontal velocity.
SO3 along(const Vector<3>& velocity);

/// Returns orientations of the target at the keyframes. In order of preference, they come from:
///
/// 1. fixes within `near` [s];
/// 2. the direction of travel, or its opposite if the nearest fixes show a target that goes astern. The speed must
///    exceed 4 standard deviations, because the direction of a slower velocity is noise;
/// 3. interpolation between the nearest orientations of these kinds, turned to the axes;
/// 4. the direction from the first to the last position, turned to the axes.
///
/// Without the axes, a target that stands would start at a saddle: where its heading is across its acceleration, the
/// cost is largest, and turns in both directions lower it.
std::vector<SO3> guess_orientations(const std::vector<Keyframe>& keyframes, const SmoothedTrack& track,
                                    const std::vector<OrientationFix>& fixes, double near,
                                    const HeadingAxes& axes = {});

}  // namespace tandem::detail
