#pragma once

#include <string>

#include <tandem/lie/types.hpp>

namespace tandem {

/// What a rigid body under water resists and what restores it, about the origin of its body frame: x forward, y left,
/// z up. Rows and columns of 6 are a twist [ν; ω] or a wrench [force; moment], N and N m. With the twist through the
/// water ν, Kirchhoff's equations in Fossen's form:
///
///   M ν' + C(ν) ν + D(ν) ν + g(R) = τ,   C(ν) ν = −ad(ν)ᵀ M ν,   D(ν) = linear + quadratic |ν| + lift |u|
///
/// Source: Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion Control, §§6, 8.1, 10.3; axes turned from
/// forward-right-down by diag(1, −1, −1).
struct VehicleBody {
  Matrix<6, 6> mass = Matrix<6, 6>::Identity();   ///< M: of the body and added by the water [kg, kg m, kg m²]
  Matrix<6, 6> linear = Matrix<6, 6>::Zero();     ///< damping [N s/m, …]
  Matrix<6, 6> quadratic = Matrix<6, 6>::Zero();  ///< times νᵢ|νᵢ| [N s²/m², …]
  Matrix<6, 6> lift = Matrix<6, 6>::Zero();       ///< of hull and fixed fins, times |surge| ν [N s²/m², …]
  double weight = 0.0, buoyancy = 0.0;            ///< N
  Vector<3> centre_of_mass = Vector<3>::Zero();   ///< m
  Vector<3> centre_of_buoyancy = Vector<3>::Zero();

  /// Kinetic energy of a twist through the water, with that of the water it drags along [J].
  double kinetic_energy(const Vector<6>& twist) const { return 0.5 * twist.dot(mass * twist); }
};

/// A vehicle with N actuators. What an actuator does follows its command with a lag, and pushes by its own column:
///
///   τ = (thrust + u|u| fin) a,   a' = (command − a)/lag,   u: surge through the water
template <int N>
struct VehicleModel : VehicleBody {
  static constexpr int actuators = N;

  Matrix<6, N> thrust = Matrix<6, N>::Zero();  ///< wrench by unit of a, at any speed
  Matrix<6, N> fin = Matrix<6, N>::Zero();     ///< and by the square of the speed [s²/m²]
  Vector<N> lag = Vector<N>::Zero();           ///< s; 0: none
  Vector<N> lower = Vector<N>::Constant(-1.0), upper = Vector<N>::Constant(1.0);  ///< of commands
};

/// Empty, or a sentence that says which matrix of the body cannot be: a mass that is not symmetric positive definite,
/// or damping that would drive the vehicle. The damping at |νᵢ| = 1, linear + quadratic + lift, must have a positive
/// definite symmetric part, and each of the three a positive semidefinite one.
std::string why_impossible(const VehicleBody& body);

}  // namespace tandem
