#pragma once

#include <vector>

#include <tandem/lie/sek3.hpp>

namespace tandem {

/// Motion of a vehicle at one instant, relative to the Earth-fixed world frame.
struct Motion {
  SE23 state;                      ///< Pose, and velocity along the world's axes [m/s].
  Vector<3> acceleration;          ///< Acceleration of the body's origin, along the world's axes [m/s²].
  Vector<3> rate;                  ///< Angular velocity of the body relative to the world, body axes [rad/s].
  Vector<3> angular_acceleration;  ///< Derivative of `rate` [rad/s²].
  double depth;                    ///< m, positive down.
};

/// Survey dive at 1.5 m/s in a current: surface leg, dive to 30 m, lawn-mower legs, ascent. The vehicle rolls and
/// pitches, most of all in surface waves. Heading, depth and speed are closed forms with three continuous derivatives.
/// The horizontal position is their numerical integral, exact to rounding.
class DiveMotion {
 public:
  static constexpr double step = 0.01;  ///< sampling interval [s]

  /// `duration`: s. `surfacings`: number of ascents to the surface during the survey.
  DiveMotion(double duration, int surfacings);

  std::size_t size() const { return positions_.size(); }
  double time(std::size_t k) const { return step * double(k); }
  /// Returns the motion at time(k), k < size().
  Motion at(std::size_t k) const;

 private:
  struct Profile;
  Profile profile(double t) const;
  Vector<3> velocity(double t) const;

  double ramp_;                                  ///< duration of one descent or ascent [s]
  std::vector<double> dives_, ascents_, turns_;  ///< start times [s]
  std::vector<Vector<3>> positions_;
};

}  // namespace tandem
