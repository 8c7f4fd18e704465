#include <algorithm>
#include <span>

#include <tandem/problem/tracking/target_window.hpp>

// States of a TargetWindow between its keyframes.
namespace tandem::detail {

/// Calls f(trajectory) for the keyframes that the state at t depends on.
template <LieGroup G>
template <class F>
MotionInstant TargetWindow<G>::with_trajectory(double t, const std::vector<Stamped<SE3>>& odometry, F f) const {
  const std::size_t k = interval_at(out_.keyframes, t), begin = k > 0 ? k - 1 : k, end = std::min(k + 3, size());
  std::vector<PoseVariable> chaser;
  std::vector<TargetVariable> target;
  std::vector<TwistVariable> twist;
  for (std::size_t i = begin; i < end; ++i) {
    chaser.emplace_back(build_.chaser[i]);
    std::visit([&](const auto& x) { target.emplace_back(x); }, build_.target[i]);
    if (!build_.twist.empty()) twist.emplace_back(build_.twist[i]);
  }
  const TrackedStates states{problem_, std::span(out_.keyframes).subspan(begin, end - begin), chaser, target, twist};
  return f(TrackingTrajectory(states, data_.noise, odometry, options_));
}

template <LieGroup G>
MotionInstant TargetWindow<G>::chaser_at(double t, const std::vector<Stamped<SE3>>& odometry,
                                         const PropagateCovariance& propagate) const {
  return with_trajectory(t, odometry, [&](const auto& trajectory) { return trajectory.chaser_at(t, propagate); });
}

template <LieGroup G>
MotionInstant TargetWindow<G>::target_at(double t, const PropagateCovariance& propagate) const {
  return with_trajectory(t, {}, [&](const auto& trajectory) { return trajectory.target_at(t, propagate); });
}

template MotionInstant TargetWindow<SE3>::chaser_at(double, const std::vector<Stamped<SE3>>&,
                                                    const PropagateCovariance&) const;
template MotionInstant TargetWindow<SE2>::chaser_at(double, const std::vector<Stamped<SE3>>&,
                                                    const PropagateCovariance&) const;
template MotionInstant TargetWindow<SE3>::target_at(double, const PropagateCovariance&) const;
template MotionInstant TargetWindow<SE2>::target_at(double, const PropagateCovariance&) const;

}  // namespace tandem::detail
