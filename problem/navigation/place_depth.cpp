#include <tandem/problem/navigation/ego_placement.hpp>
#include <tandem/residuals/depth.hpp>

namespace tandem::detail {

Block place_depth(const EgoPlacing& at, const EgoMeasurement& m) {
  return place(at, Depth{m.value.z(), at.sensor.mount.translation()});
}

}  // namespace tandem::detail
