#include <tandem/problem/navigation/ego_placing.hpp>
#include <tandem/residuals/dvl_velocity.hpp>

namespace tandem::detail {

Block place_dvl(const EgoPlacing& at, const EgoMeasurement& m) {
  return at.dvl_scale ? place(at, ScaledDvlVelocity{m.value}) : place(at, DvlVelocity{m.value});
}

}  // namespace tandem::detail
