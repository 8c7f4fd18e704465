#pragma once

#include <vector>

#include <tandem/problem/navigation/navigation_problem.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem {

/// Data of the chaser's own sensors, which replace the odometry of a tracking problem.
struct EgoTrack {
  NavigationData data;
  Alignment start;                        ///< prior of the first state
  std::vector<Stamped<EgoState>> states;  ///< initial guess: at least two in time order, the first at start.t
  EgoOptions options;

  /// Returns the initial guess at t, interpolated. Returns the first or the last state outside of their time span.
  EgoState at(double t) const;
  /// Returns both ends of each interval between consecutive `states` that IMU samples do not cover. Keyframes are
  /// required at these times.
  std::vector<double> required_keyframe_times() const;
};

namespace detail {

/// Adds the chaser to a tracking problem, keyframe by keyframe.
class EgoTrackBuild {
 public:
  EgoTrackBuild(const EgoTrack& track, TrackingProblem& out);

  /// Adds keyframe k, connects it to the previous one, and attaches the measurements up to the next one.
  Variable<SE3> add(std::size_t k);

 private:
  const EgoTrack& track_;
  TrackingProblem& out_;
  EgoChain chain_;
  std::vector<EgoEvent> events_;
  std::vector<EgoEvent>::const_iterator event_;
};

}  // namespace detail

}  // namespace tandem
