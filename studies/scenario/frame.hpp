#pragma once

#include <string>

#include <tandem/lie/sek3.hpp>

namespace tandem {

/// The axes a scenario's files are in: world and body. Inside, all is ENU-FLU (world x east, y north, z up; body x
/// forward, y left, z up); NED-FRD (north, east, down; forward, right, down) is converted when read and when written.
/// Every conversion is its own inverse.
class Frame {
 public:
  Frame() = default;  ///< ENU-FLU
  static Frame enu_flu() { return {}; }
  static Frame ned_frd();

  bool is_ned() const { return ned_; }
  std::string name() const { return ned_ ? "NED-FRD" : "ENU-FLU"; }

  /// A vector along the world's axes, the pose of a body in the world.
  Vector<3> world(const Vector<3>& p) const;
  SE3 world(const SE3& pose) const;
  /// A vector along a body's axes, the pose of one body in another.
  Vector<3> body(const Vector<3>& p) const;
  SE3 body(const SE3& pose) const;
  SO3 body(const SO3& R) const;
  /// An azimuth or elevation, measured towards y or z of a body.
  double angle(double a) const { return ned_ ? -a : a; }
  /// The matrices behind it: world(p) = world_axes() p, body(p) = body_axes() p.
  Matrix<3, 3> world_axes() const;
  Matrix<3, 3> body_axes() const;

 private:
  bool ned_ = false;
};

}  // namespace tandem
