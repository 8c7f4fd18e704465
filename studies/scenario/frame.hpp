#pragma once

#include <string>

#include <tandem/lie/sek3.hpp>

namespace tandem {

/// The axis conventions of the files of a scenario. Tandem works in ENU-FLU: world axes east, north, up; body axes
/// forward, left, up. Files in NED-FRD (north, east, down; forward, right, down) are converted when they are read and
/// written. Every conversion is its own inverse.
class Frame {
 public:
  Frame() = default;  ///< ENU-FLU
  static Frame enu_flu() { return {}; }
  static Frame ned_frd();

  bool is_ned() const { return ned_; }
  std::string name() const { return ned_ ? "NED-FRD" : "ENU-FLU"; }

  /// Converts a vector in world axes, or the pose or orientation of a body in the world.
  Vector<3> world(const Vector<3>& p) const;
  SE3 world(const SE3& pose) const;
  SO3 world(const SO3& R) const;
  /// Converts a vector in body axes, or a pose or rotation of one body relative to another.
  Vector<3> body(const Vector<3>& p) const;
  SE3 body(const SE3& pose) const;
  SO3 body(const SO3& R) const;
  /// Converts an azimuth (towards the body's y axis) or an elevation (towards its z axis).
  double angle(double a) const { return ned_ ? -a : a; }
  /// Return the matrices of the conversions: world(p) = world_axes() p, body(p) = body_axes() p.
  Matrix<3, 3> world_axes() const;
  Matrix<3, 3> body_axes() const;

 private:
  bool ned_ = false;
};

}  // namespace tandem
