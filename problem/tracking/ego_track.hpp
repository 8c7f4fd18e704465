#pragma once

#include <vector>

#include <tandem/problem/navigation/navigation_problem.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem {

/// The chaser of a tracking problem by its own sensors, in place of odometry.
struct EgoTrack {
  NavigationData data;
  Alignment start;                        ///< what is known of the first state beforehand
  std::vector<Stamped<EgoState>> states;  ///< first guess: two or more, in time order, the first at start.t
  EgoOptions options;

  /// Interpolated; before the first and after the last, these.
  EgoState at(double t) const;
  /// Where keyframes have to stand, since the inertial samples do not tie the states there: both ends of each such
  /// interval; all of them without an IMU.
  std::vector<double> untied() const;
};

namespace detail {

/// Adds the chaser's part to a tracking problem, keyframe by keyframe.
class EgoTrackBuild {
 public:
  EgoTrackBuild(const EgoTrack& track, TrackingProblem& out);

  /// Keyframe k, the ties to the one before, and the measurements from there to the next.
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
