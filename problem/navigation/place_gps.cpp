#include <tandem/problem/navigation/ego_placement.hpp>
#include <tandem/residuals/gps.hpp>

namespace tandem::detail {

Block place_gps(const EgoPlacing& at, const EgoMeasurement& m) {
  return place(at, Gps{m.value, at.sensor.mount.translation()});
}

}  // namespace tandem::detail
