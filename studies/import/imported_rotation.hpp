#pragma once

#include <array>
#include <optional>
#include <string>

#include <tandem/studies/import/import_axes.hpp>

namespace tandem {

/// An orientation in one of the representations that recordings use. Angles are in radians.
struct RotationInput {
  double xyzw[4] = {}, wxyz[4] = {};
  double roll = 0, pitch = 0, yaw = 0;  ///< Turns about z, then y, then x of the body, from the axes of the world.
  double heading = 0;                   ///< Direction of the body's forward axis, clockwise from north.
  double euler[3] = {};                 ///< Turns about the body's axes, in the order of `euler_order`.
  double magnetic_field[3] = {};        ///< Along the body's axes; the body is taken as level.
  std::string euler_order{};
  enum class Way { angles, xyzw, wxyz, euler, heading, magnetic_field } way = Way::angles;

  /// Sets `way` for a quantity of import_types.hpp and returns its values. Returns null for other quantities.
  double* find(const std::string& quantity);
  /// Returns the norm of the quaternion.
  double norm() const;
};

/// Returns the orientation x y z w in the scenario's axes: `world` maps the axes of the parent (the world, or another
/// body), `body` those of the body itself. Nothing if the norm of a quaternion differs from 1 by more than 0.05.
std::optional<std::array<double, 4>> rotation_of(const RotationInput& input, const ImportAxes& axes,
                                                 const AxisMap& world, const AxisMap& body);

/// Returns an orientation in the world, turned clockwise (seen from above) by an angle [rad]. `ned`: z points down.
std::array<double, 4> turned_clockwise(const std::array<double, 4>& xyzw, double angle, bool ned);

}  // namespace tandem
