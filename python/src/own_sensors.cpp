#include <tandem/residuals/depth.hpp>
#include <tandem/residuals/dvl_velocity.hpp>
#include <tandem/residuals/gps.hpp>
#include <tandem/residuals/heading.hpp>
#include <tandem/residuals/preintegrated_dvl.hpp>

#include "residual_family.hpp"

namespace tandem::python {

void bind_own_sensors(py::module_& m) {
  declare<Depth>(m, "Depth", {"z", "lever"}, 1,
                 "Depth(z, lever=0)\n\nMeasured height of a sensor in the world [m], upwards. States: a pose.");
  declare<Gps>(m, "Gps", {"position", "lever"}, 1,
               "Gps(position, lever=0)\n\nMeasured position of an antenna in the world [m]. States: a pose.");
  declare<Heading>(m, "Heading", {"measured", "mount"}, 1,
                   "Heading(measured, mount=identity)\n\nMeasured orientation [rad]. States: a pose.");
  declare<DvlVelocity>(m, "DvlVelocity", {"measured"}, 1,
                       "DvlVelocity(measured)\n\nMeasured velocity along the body axes [m/s]. States: pose, velocity.");
  declare<ScaledDvlVelocity>(
      m, "ScaledDvlVelocity", {"measured"}, 1,
      "ScaledDvlVelocity(measured)\n\nDvlVelocity with a scale factor error. States: pose, velocity, R1.");
  declare<PreintegratedDvl>(m, "PreintegratedDvl", {"displacement"}, 1,
                            "PreintegratedDvl(displacement)\n\nMeasured displacement [m]. States: two poses.");
}

}  // namespace tandem::python
