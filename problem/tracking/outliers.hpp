#pragma once

#include <cstddef>
#include <vector>

#include <tandem/problem/stop.hpp>
#include <tandem/problem/tracking/keyframes.hpp>
#include <tandem/problem/tracking/tracking_data.hpp>

namespace tandem {

/// A measurement that the others contradict.
struct Outlier {
  std::size_t sensor, index;  ///< in the data
  double sigmas;              ///< from what the others say, in standard deviations of that
  bool gross;                 ///< it is of something else: 100 standard deviations off, or 45° with ten of them
};

/// Measurements more than ten standard deviations from what all others say, the worst first. `chaser`: its poses at the
/// keyframes.
///
/// Positions by data snooping: while some are too far from a smoothed track of all, the one whose residual is the most
/// standard deviations of its own is taken out, and at the end those that then agree are let in again. One outlier,
/// however far, is always the first to go. The track is of constant velocity, but for what the data's noise lets it
/// change by and what a target takes that turns round within ten seconds: a tight turn is no outlier, however stiff the
/// motion's prior.
///
/// A range or a direction without the other by that track, where it is told, and by the sensor's own measurements around
/// it: eight each way within ten seconds, their L1 medoid, and their median distance from that as the scale, where it is
/// above the noise.
///
/// Sources: Baarda 1968, "A testing procedure for use in geodetic networks"; Davies & Gather 1993, "The identification of
/// multiple outliers" (the Hampel identifier). Throws Stopped when it is to stop.
std::vector<Outlier> outliers(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                              const std::vector<SE3>& chaser, const Stop& stop = {});

/// Whether each measurement of each sensor is among them; `gross`: among the gross ones.
std::vector<std::vector<bool>> marked(const TrackingData& data, const std::vector<Outlier>& outliers,
                                      bool gross = false);

}  // namespace tandem
