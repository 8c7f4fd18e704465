#include <tandem/problem/navigation/ego_placing.hpp>
#include <tandem/residuals/dvl_velocity.hpp>

namespace tandem::detail {

Block place_dvl(const EgoPlacing& at, const EgoMeasurement& m) {
  const bool scaled = at.dvl_scale && !at.sensor.error;  // with errors, the scale is one of them
  return scaled ? place(at, ScaledDvlVelocity{m.value}) : place(at, DvlVelocity{m.value});
}

}  // namespace tandem::detail
