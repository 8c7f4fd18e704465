#pragma once

#include <vector>

#include <tandem/lie/sek3.hpp>

namespace tandem {

/// The motion of a vehicle at an instant, relative to a world that turns with the Earth.
struct Motion {
  SE23 state;              ///< pose, and velocity along the world's axes [m/s]
  Vector<3> acceleration;  ///< of the body's origin, along the world's axes [m/s²]
  Vector<3> rate;          ///< of the body against the world, along its own axes [rad/s]
  Vector<3> rate_rate;     ///< its derivative [rad/s²]
  double depth;            ///< m, downwards
};

/// A survey: some way at the surface, a dive to 30 m, legs to and fro as of a lawn mower, and back up; 1.5 m/s, in a
/// current, rolling and pitching, more so in the waves of the surface. Heading, depth and speed are closed forms with
/// three derivatives; positions are their integral to rounding.
class DiveMotion {
 public:
  static constexpr double step = 0.01;  ///< s, between the instants that are known

  /// `surfacings`: how often it comes up on the way.
  DiveMotion(double duration, int surfacings);

  std::size_t size() const { return positions_.size(); }
  double time(std::size_t k) const { return step * double(k); }
  Motion at(std::size_t k) const;

 private:
  struct Profile;
  Profile profile(double t) const;
  Vector<3> velocity(double t) const;

  double duration_, ramp_;                       ///< s: the whole, one dive or ascent
  std::vector<double> dives_, ascents_, turns_;  ///< s, when each begins
  std::vector<Vector<3>> positions_;
};

}  // namespace tandem
