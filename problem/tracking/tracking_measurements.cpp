#include <tandem/problem/tracking/sensor_build.hpp>

namespace tandem::detail {

template <LieGroup G>
void TrackingBuild<G>::add_measurement(std::size_t sensor, std::size_t i, std::size_t k) {
  SensorBuild<G, false>(*this, sensor).add(i, k);
}

template void TrackingBuild<SE3>::add_measurement(std::size_t, std::size_t, std::size_t);
template void TrackingBuild<SE2>::add_measurement(std::size_t, std::size_t, std::size_t);

}  // namespace tandem::detail
