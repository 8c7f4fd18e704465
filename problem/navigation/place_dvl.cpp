#include <tandem/problem/navigation/ego_placement.hpp>
#include <tandem/residuals/dvl_velocity.hpp>

namespace tandem::detail {

Block place_dvl(const EgoPlacing& at, const EgoMeasurement& m) {
  const bool scaled = at.dvl_scale && !at.sensor.error;  // systematic errors include the scale factor
  return scaled ? place(at, ScaledDvlVelocity{m.value}) : place(at, DvlVelocity{m.value});
}

}  // namespace tandem::detail
