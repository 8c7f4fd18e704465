#pragma once

#include <cmath>
#include <tuple>

#include <tandem/lie/types.hpp>

namespace tandem {

/// Gravity and Earth rotation at the location of an inertial sensor, along world axes (east, north, up).
struct Earth {
  static constexpr double kRate = 7.292115e-5;  ///< rad/s, WGS 84

  Vector<3> gravity{0, 0, -9.80665};   ///< m/s², acceleration in free fall (downwards)
  Vector<3> rate = Vector<3>::Zero();  ///< rad/s; zero treats the world as an inertial frame

  auto fields() { return std::tie(gravity, rate); }

  /// Constructs a non-rotating Earth with this magnitude of gravity [m/s²].
  static Earth with_gravity(double magnitude) { return {{0, 0, -magnitude}, Vector<3>::Zero()}; }
  /// Constructs a rotating Earth at a latitude [rad] with this magnitude of gravity [m/s²].
  static Earth at_latitude(double latitude, double magnitude) {
    return {{0, 0, -magnitude}, {0, kRate * std::cos(latitude), kRate * std::sin(latitude)}};
  }
  /// Returns the normal gravity [m/s²] on the ellipsoid at a latitude [rad] by Somigliana's formula with the constants
  /// of WGS 84 (NIMA TR8350.2, eq. 4-1).
  static double normal_gravity(double latitude) {
    constexpr double equator = 9.7803253359, k = 0.00193185265241, e2 = 0.00669437999013;
    const double s2 = std::sin(latitude) * std::sin(latitude);
    return equator * (1 + k * s2) / std::sqrt(1 - e2 * s2);
  }
};

}  // namespace tandem
