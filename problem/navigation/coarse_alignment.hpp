#pragma once

#include <tandem/problem/navigation/ego_chain.hpp>

namespace tandem {

/// A first state out of the first seconds of a recording, before anything is estimated.
struct Alignment {
  double t = 0;                  ///< s, where the first keyframe stands
  EgoState state{};              ///< there
  EgoSpread spread{};            ///< how far it may be off
  bool heading_unknown = false;  ///< something will tell it, but not at once: `state` faces some way

  /// The same, turned about the vertical by an angle [rad]; a velocity that the DVL gave turns along.
  EgoState turned(double angle) const;

  bool velocity_in_body = false;  ///< it came from the DVL
};

/// When a chaser can be estimated from on [s]: the inertial sensor's first sample; where that comes late, or never, the
/// first measurement of the others, with a DVL and a heading to move by. Nothing when there is neither.
std::optional<double> start_time(const NavigationData& data);

/// Roll and pitch from the mean specific force of the first second, heading from the heading sensor, position from gps
/// and depth, velocity from the DVL or two fixes, as far as there are any. Without a heading sensor the heading is
/// unknown when there is gps, or a turning Earth; when nothing can tell it, or the position, they are zero by definition.
/// Throws Error without an inertial sensor, or a DVL with a heading, to move by.
Alignment coarse_alignment(const NavigationData& data);

}  // namespace tandem
