#pragma once

#include <tandem/problem/navigation/ego_chain.hpp>

namespace tandem {

/// Initial state of the chaser, computed from the first seconds of a recording before any estimation.
struct Alignment {
  double t = 0;                    ///< time of the first keyframe [s]
  EgoState state{};                ///< state at t
  EgoStateSigmas sigmas{};         ///< standard deviations of `state`
  bool heading_unknown = false;    ///< whether the heading of `state` is arbitrary; later measurements determine it
  bool velocity_from_dvl = false;  ///< whether the velocity of `state` was measured along body axes

  /// Returns `state`, rotated about the vertical by an angle [rad]. Also rotates a velocity from the DVL.
  EgoState rotated_about_vertical(double angle) const;
};

/// Returns the time from which the chaser can be estimated [s]. This is the time of the first IMU sample. If the IMU is
/// missing or starts more than 5 s after the other sensors, and there is a DVL with a heading sensor, it is the time of
/// the first measurement. Without an IMU, a GPS receiver may replace the DVL. Returns nullopt if the data have none of
/// these.
std::optional<double> start_time(const NavigationData& data);

/// Computes the initial state from the sensors that are available. Roll and pitch come from the mean specific force of
/// the first second, heading from the heading sensor, position from GPS and depth, velocity from the DVL or two fixes.
///
/// Without a heading sensor, the heading is unknown if GPS or a rotating Earth makes it observable. A heading or
/// position that no sensor observes is zero by definition. Throws Error if start_time() returns nullopt.
Alignment coarse_alignment(const NavigationData& data);

}  // namespace tandem
