#pragma once

#include <string>

#include <tandem/lie/types.hpp>

namespace tandem {

/// Hydrodynamics and restoring forces of a rigid body under water, about the origin of its body frame (x forward, y
/// left, z up). Rows and columns of 6 are a twist [ν; ω] or a wrench [force; moment] in N and N m. With the twist ν
/// through the water, Kirchhoff's equations in Fossen's form are
///
///   M ν' + C(ν) ν + D(ν) ν + g(R) = τ,   C(ν) ν = −ad(ν)ᵀ M ν,   D(ν) = linear + quadratic |ν| + lift |u|
///
/// Source: Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion Control, §§6, 8.1, 10.3; axes converted from
/// forward-right-down by diag(1, −1, −1).
struct VehicleBody {
  Matrix<6, 6> mass = Matrix<6, 6>::Identity();   ///< M: rigid-body and added mass [kg, kg m, kg m²].
  Matrix<6, 6> linear = Matrix<6, 6>::Zero();     ///< Linear damping [N s/m, …].
  Matrix<6, 6> quadratic = Matrix<6, 6>::Zero();  ///< Quadratic damping, times νᵢ|νᵢ| [N s²/m², …].
  Matrix<6, 6> lift = Matrix<6, 6>::Zero();       ///< Lift of hull and fixed fins, times |surge| ν [N s²/m², …].
  double weight = 0.0, buoyancy = 0.0;            ///< N
  Vector<3> centre_of_mass = Vector<3>::Zero();   ///< m
  Vector<3> centre_of_buoyancy = Vector<3>::Zero();  ///< m

  /// Returns the kinetic energy of a twist through the water, including the added mass [J].
  double kinetic_energy(const Vector<6>& twist) const { return 0.5 * twist.dot(mass * twist); }
};

/// Vehicle with N actuators. Each actuator state a follows its command with a first-order lag and produces a wrench
/// along its own column:
///
///   τ = (thrust + u|u| fin) a,   a' = (command − a)/lag,   u: surge through the water
template <int N>
struct VehicleModel : VehicleBody {
  static constexpr int actuators = N;

  Matrix<6, N> thrust = Matrix<6, N>::Zero();  ///< wrench per unit of a, independent of speed
  Matrix<6, N> fin = Matrix<6, N>::Zero();     ///< wrench per unit of a and squared speed [s²/m²]
  Vector<N> lag = Vector<N>::Zero();           ///< time constant [s]; 0: no lag
  Vector<N> lower = Vector<N>::Constant(-1.0), upper = Vector<N>::Constant(1.0);  ///< limits of commands
};

/// Returns an empty string or the reason why the body is invalid. The mass matrix must be symmetric positive definite.
/// The damping at |νᵢ| = 1 is linear + quadratic + lift. Its symmetric part must be positive definite. The symmetric
/// part of each term must be positive semidefinite.
std::string why_invalid(const VehicleBody& body);

}  // namespace tandem
