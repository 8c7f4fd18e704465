#pragma once

#include <optional>
#include <vector>

#include <tandem/problem/tracking/tracking_data.hpp>

namespace tandem {

/// A keyframe counts as optical when it has a pose measurement, else as usbl when one measurement gives a position, else
/// as gated.
enum class KeyframeType { usbl, optical, gated };

/// An instant of a tracking problem at which chaser and target have states.
struct Keyframe {
  double t;  ///< s
  KeyframeType type;
  std::optional<Vector<3>>
      measured_position;                 ///< of the target in the chaser's body, by the sensor that gives the type
  std::optional<SO3> measured_rotation;  ///< likewise; only where optical
};

/// Keyframes of a tracking problem: at the first and last odometry time, at every relative measurement (when it was
/// valid, so before its stamp by the sensor's delay), and each keyframe_interval after the last one while nothing
/// arrives. Times closer than 1 ms are one. `most` > 0 keeps the first ones only. Measurements that their delay puts
/// before the odometry are left out. With TrackingData::ego also where its states are not tied, and measurements outside
/// the odometry's span are left out. Throws Error without odometry or measurements, or when a stamp is outside the
/// odometry's time span.
std::vector<Keyframe> make_keyframes(const TrackingData& data, std::size_t most = 0);

/// Index of the keyframe at time t, to 1 ms.
std::optional<std::size_t> keyframe_at(const std::vector<Keyframe>& keyframes, double t);
/// That of this instant, or the last before it; none before the first and after the last.
std::optional<std::size_t> keyframe_until(const std::vector<Keyframe>& keyframes, double t);

/// The odometry stream interpolated on SE(3) at the keyframes.
std::vector<SE3> odometry_at(const std::vector<Stamped<SE3>>& odometry, const std::vector<Keyframe>& keyframes);

}  // namespace tandem
