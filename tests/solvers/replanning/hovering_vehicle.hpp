#pragma once

#include <tandem/solvers/replanning/planner.hpp>

namespace tandem::testing {

/// Returns a hovering vehicle with one actuator for each of the six axes, and two without effect.
inline VehicleModel<8> hovering_vehicle() {
  VehicleModel<8> v;
  v.mass.diagonal() << 20.0, 21.0, 32.0, 0.5, 0.4, 0.6;
  v.linear.diagonal() << 13.7, 10.0, 33.0, 0.3, 0.8, 0.5;
  v.quadratic.diagonal() << 141.0, 217.0, 190.0, 1.2, 0.5, 1.5;
  v.weight = v.buoyancy = 130.0;
  v.centre_of_buoyancy = {0.0, 0.0, 0.01};
  v.thrust.leftCols<6>().diagonal() << 1.0, 1.0, 1.0, 0.2, 0.2, 0.2;
  v.lower.setConstant(-40.0);
  v.upper.setConstant(40.0);
  v.lag.setConstant(0.2);
  return v;
}

}  // namespace tandem::testing
