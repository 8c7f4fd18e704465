#pragma once

#include <cstddef>
#include <vector>

#include <tandem/problem/stop.hpp>
#include <tandem/problem/tracking/keyframes.hpp>
#include <tandem/problem/tracking/tracking_data.hpp>

namespace tandem {

/// A measurement that contradicts the others.
struct Outlier {
  std::size_t sensor, index;  ///< Indices in TrackingData::sensors and TargetSensor::measurements.
  double sigmas;              ///< Distance from the value expected from the others, in standard deviations.
  /// The measurement is unrelated to the target: it deviates by 100 sigmas of its noise or, as a direction, by 45°.
  bool gross;
};

/// Returns the measurements that deviate by more than ten standard deviations from the others, worst first. `chaser`
/// gives the chaser's poses at the keyframes.
///
/// Positions are tested by data snooping. A smoother computes a track from all positions. The position with the largest
/// standardised residual in its neighbourhood is removed, and the track is recomputed, until no residual is too large.
/// Finally, removed positions that agree with the track are accepted again. The track has constant velocity with
/// process noise from the data's noise, plus the noise of a target that reverses its velocity every ten seconds. Thus a
/// tight turn is not an outlier, even if the motion prior is stiff.
///
/// A sensor that measures only ranges or only directions is compared with this track, if there is one. It is also
/// compared with its neighbours: up to eight measurements on either side within ten seconds. Their L1 medoid is the
/// expected value, and their median distance from it is the scale, with the noise as lower bound.
///
/// Sources: Baarda 1968, "A testing procedure for use in geodetic networks"; Davies & Gather 1993, "The identification
/// of multiple outliers" (Hampel identifier). Throws Stopped if `stop` requests it.
std::vector<Outlier> outliers(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                              const std::vector<SE3>& chaser, const Stop& stop = {});

/// Returns flags by [sensor][index] that mark the outliers. `gross` marks only the gross ones.
std::vector<std::vector<bool>> outlier_mask(const TrackingData& data, const std::vector<Outlier>& outliers,
                                            bool gross = false);

}  // namespace tandem
