#pragma once

#include <algorithm>
#include <span>

#include <tandem/problem/navigation/ego_chain.hpp>
#include <tandem/problem/navigation/motion_instant.hpp>

namespace tandem {

/// Continuous trajectory of a chaser that moves by its own sensors, at the present values of its keyframes.
///
/// The state at an instant is the conditional mean of a keyframe there, given the keyframes on both sides. The
/// residuals are those of EgoChain: preintegrated IMU samples, or Coasting in gaps and without an IMU. The result is
/// exact if they are linear. The turn rate is that of the gyroscope, averaged over 0.1 s, or else the mean between the
/// keyframes.
class EgoTrajectory {
 public:
  /// `imu` is null without an IMU. The arguments must outlive this object.
  EgoTrajectory(const Problem& problem, std::span<const EgoKeyframe> keyframes, const ImuRecord* imu,
                const Earth& earth, const EgoOptions& options);

  /// Returns the chaser at t, between the first and the last keyframe, with its covariance if `propagate` is given.
  /// Throws BadInputError if t is outside, and exceptions of `propagate`.
  MotionInstant at(double t, const PropagateCovariance& propagate = {}) const;

 private:
  const Problem& problem_;
  std::span<const EgoKeyframe> keyframes_;
  const ImuRecord* imu_;
  const Earth& earth_;
  EgoOptions options_;
};

/// Returns k so that t is between the entries k and k + 1 of `keyframes`, which have a member t [s]. Throws
/// BadInputError if there is no such interval.
template <class Keyframes>
std::size_t interval_at(const Keyframes& keyframes, double t);

/// Throws BadInputError: t is outside of a trajectory of `count` keyframes.
[[noreturn]] void throw_outside(double t, double first, double last, std::size_t count);

template <class Keyframes>
std::size_t interval_at(const Keyframes& keyframes, double t) {
  const std::size_t count = keyframes.size();
  if (count < 2 || !(t >= keyframes.front().t && t <= keyframes.back().t))
    throw_outside(t, count > 0 ? keyframes.front().t : 0, count > 0 ? keyframes.back().t : 0, count);
  const auto next = std::upper_bound(keyframes.begin(), keyframes.end(), t,
                                     [](double time, const auto& keyframe) { return time < keyframe.t; });
  return std::min(std::size_t(next - keyframes.begin()), count - 1) - 1;
}

}  // namespace tandem
