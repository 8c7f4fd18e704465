#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/staying_error_checks.hpp>
#include <tandem/problem/tracking/tracking_build.hpp>

namespace tandem::detail {
namespace {

template <LieGroup G>
void place_by_type(TrackingBuild<G>& build, const Placing& at) {
  const TargetSensor& sensor = build.data.sensors[at.sensor];
  const auto place = sensor.type->place.of<G>();
  if (!place) throw Error(sensor.name + ": a planar problem takes no sensor of type " + std::string(name(sensor.type)));
  if (sensor.error)
    if (const std::string why = why_invalid(*sensor.error); !why.empty()) throw Error(sensor.name + ".error: " + why);
  place(build, at);
}

}  // namespace

template <LieGroup G>
void TrackingBuild<G>::add_measurement(std::size_t sensor, std::size_t i, std::size_t k) {
  place_by_type(*this, {sensor, i, k});
}

template <LieGroup G>
void TrackingBuild<G>::add_measurement_after(std::size_t sensor, std::size_t i, std::size_t k) {
  const double t = data.sensors[sensor].valid_at(data.sensors[sensor].measurements[i]);
  place_by_type(*this, {sensor, i, k, (t - out.keyframes[k].t) / dt(k, k + 1)});
}

template void TrackingBuild<SE3>::add_measurement(std::size_t, std::size_t, std::size_t);
template void TrackingBuild<SE2>::add_measurement(std::size_t, std::size_t, std::size_t);
template void TrackingBuild<SE3>::add_measurement_after(std::size_t, std::size_t, std::size_t);
template void TrackingBuild<SE2>::add_measurement_after(std::size_t, std::size_t, std::size_t);

}  // namespace tandem::detail
