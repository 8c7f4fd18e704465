#include <tandem/residuals/boundary.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/relative_rotation.hpp>
#include <tandem/residuals/roll_pitch.hpp>

#include "residual_family.hpp"

namespace tandem::python {

void bind_measurements(py::module_& m) {
  declare<Prior<SE3>, Prior<SE2>, Prior<SO3>, Prior<SO2>, Prior<SE23>, Prior<Rn<1>>, Prior<Rn<2>>, Prior<Rn<3>>,
          Prior<Rn<4>>, Prior<Rn<5>>, Prior<Rn<6>>, Prior<Rn<8>>, Prior<Rn<9>>, Prior<Rn<12>>, Prior<Bundle<SE3, R3>>,
          Prior<Bundle<SE3, Rn<6>>>, Prior<Bundle<SE3, SE3>>, Prior<Bundle<SE2, R3>>>(
      m, "Prior", {"z"}, 1, "Prior(z)\n\nMeasured value of a state: log(z^-1 X). States: any group.");
  declare<RelativePose<SE3>, RelativePose<SE2>, RelativePose<SO3>, RelativePose<SO2>, RelativePose<Rn<1>>,
          RelativePose<Rn<2>>, RelativePose<Rn<3>>, RelativePose<Rn<6>>, RelativePose<Bundle<SE3, R3>>,
          RelativePose<Bundle<SE3, Rn<6>>>, RelativePose<Bundle<SE3, SE3>>, RelativePose<Bundle<SE2, R3>>>(
      m, "RelativePose", {"z", "B", "F"}, 1,
      "RelativePose(z, B=identity, F=identity)\n\nMeasured pose of Y F in the frame X B: log(z^-1 (X B)^-1 (Y F)). "
      "States: X, Y.");
  declare<RelativeRotation<SE3>>(
      m, "RelativeRotation", {"z", "B", "F"}, 1,
      "RelativeRotation(z, B=identity, F=identity)\n\nMeasured rotation of one pose in another [rad]. States: X, Y.");
  declare<RollPitch<SE3>>(m, "RollPitch", {}, 0,
                          "RollPitch()\n\nRoll and pitch of a level body [rad]. States: a pose.");
  declare<Boundary<SE3>, Boundary<SE2>>(
      m, "Boundary", {}, 0, "Boundary()\n\nCoincidence of a pose and a point: t(X) - x [m]. States: pose, point.");
}

}  // namespace tandem::python
