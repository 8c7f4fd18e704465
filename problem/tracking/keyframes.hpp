#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include <tandem/problem/tracking/tracking_data.hpp>

namespace tandem {

/// Best measurement of the target at a keyframe. The precedence is pose, position, partial, none. `partial` stands for
/// measurements that give neither a pose nor a position, such as a bearing or a range; `none` for no measurement.
enum class KeyframeType { position, pose, partial, none };

/// All keyframe types, in the order of tables and files.
inline constexpr std::array keyframe_types = {KeyframeType::position, KeyframeType::pose, KeyframeType::partial,
                                              KeyframeType::none};

/// Returns "position", "pose", "partial" or "none".
std::string_view name(KeyframeType type);

/// A time at which chaser and target have states.
struct Keyframe {
  double t;  ///< s
  KeyframeType type;
  std::optional<Vector<3>> measured_position;  ///< target in the chaser's body [m]; for position and pose keyframes
  std::optional<SO3> measured_rotation;        ///< target in the chaser's body; for pose keyframes
};

/// Updates the type of a keyframe, and the measured position and rotation, for a measurement at it.
void update_type(Keyframe& keyframe, const TargetSensor& sensor, const Measurement& m);

/// Computes the keyframes of a tracking problem. There is one at the first and the last odometry time, and one at each
/// relative measurement, at its time of validity. In gaps, there is one every keyframe_interval. With
/// TrackingData::ego, EgoTrack::required_keyframe_times() adds more. Times closer than 1 ms share a keyframe.
///
/// Ignores measurements that were valid before the odometry. With TrackingData::ego, ignores all measurements outside
/// of the odometry's time span. `max_count` > 0 keeps only the first keyframes. Throws Error if there is no odometry or
/// no measurement, or if a time stamp is outside the odometry's time span.
std::vector<Keyframe> make_keyframes(const TrackingData& data, std::size_t max_count = 0);

/// Returns the index of the keyframe within 1 ms of t, or nullopt.
std::optional<std::size_t> keyframe_at(const std::vector<Keyframe>& keyframes, double t);
/// Returns the index of the keyframe within 1 ms of t, or else of the last one before t. Returns nullopt before the
/// first and after the last keyframe.
std::optional<std::size_t> keyframe_at_or_before(const std::vector<Keyframe>& keyframes, double t);

/// Returns the odometry at the keyframes, interpolated on SE(3).
std::vector<SE3> odometry_at(const std::vector<Stamped<SE3>>& odometry, const std::vector<Keyframe>& keyframes);

}  // namespace tandem
