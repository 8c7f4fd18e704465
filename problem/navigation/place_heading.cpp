#include <tandem/problem/navigation/ego_placement.hpp>
#include <tandem/residuals/heading.hpp>

namespace tandem::detail {

Block place_heading(const EgoPlacing& at, const EgoMeasurement& m) {
  return place(at, Heading{m.rotation, at.sensor.mount.rotation()});
}

}  // namespace tandem::detail
