#include <tandem/residuals/vehicle/quadrotor.hpp>

#include "residual_family.hpp"

namespace tandem::python {

void bind_quadrotor(py::module_& m) {
  declare<EulerKinematics<SE3>, EulerKinematics<SE2>, EulerKinematics<SO3>, EulerKinematics<R3>, EulerKinematics<R2>>(
      m, "EulerKinematics", {"dt"}, 1,
      "EulerKinematics(dt)\n\nMotion by the rate at the start of a step of dt [s]: log((X0 exp(dt w0))^-1 X1). States: "
      "X0, rate (vector), X1.");
  const std::vector<std::string> quadrotor{"mass", "inertia", "arm", "yaw_torque", "gravity", "dt"};
  declare<QuadrotorRate>(
      m, "QuadrotorRate", quadrotor, quadrotor.size(),
      "QuadrotorRate(mass, inertia, arm, yaw_torque, gravity, dt)\n\nEuler's equation of a quadrotor over a step of dt "
      "[s], in plus configuration: rotor 0 is ahead, 1 to the left, 2 behind, 3 to the right. `inertia` has the "
      "principal moments [kg m^2], `arm` is the distance to a rotor [m], `yaw_torque` the torque per thrust [m]. "
      "States: "
      "body rate (R3) [rad/s], thrusts (R4) [N], body rate.");
  declare<QuadrotorVelocity>(m, "QuadrotorVelocity", quadrotor, quadrotor.size(),
                             "QuadrotorVelocity(mass, inertia, arm, yaw_torque, gravity, dt)\n\nNewton's equation of a "
                             "quadrotor over a step of "
                             "dt [s]; the arguments are those of QuadrotorRate. States: velocity (R3) [m/s], attitude "
                             "(SO3), thrusts (R4) [N], "
                             "velocity.");
}

}  // namespace tandem::python
