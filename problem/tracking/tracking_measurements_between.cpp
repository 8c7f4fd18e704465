#include <tandem/problem/tracking/sensor_build.hpp>

namespace tandem::detail {

template <LieGroup G>
void TrackingBuild<G>::add_measurement_after(std::size_t sensor, std::size_t i, std::size_t k) {
  const double t = data.sensors[sensor].valid_at(data.sensors[sensor].measurements[i]);
  SensorBuild<G, true>(*this, sensor).add(i, k, (t - out.keyframes[k].t) / dt(k, k + 1));
}

template void TrackingBuild<SE3>::add_measurement_after(std::size_t, std::size_t, std::size_t);
template void TrackingBuild<SE2>::add_measurement_after(std::size_t, std::size_t, std::size_t);

}  // namespace tandem::detail
