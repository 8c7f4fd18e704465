#include <algorithm>
#include <cmath>
#include <vector>

#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/tracking_build.hpp>
#include <tandem/residuals/log_range.hpp>
#include <tandem/residuals/steady_course.hpp>

namespace tandem::detail {

template <LieGroup G>
void TrackingBuild<G>::assume_range() {
  constexpr double kMinRange = 1;  // m
  std::vector<const PlacedMeasurement*> bearings;
  for (const PlacedMeasurement& m : out.measurements) {
    if (!m.block && !m.position) continue;
    const SensorType type = data.sensors[m.sensor].type;
    if (type->has(measured::position | measured::range) || !type->has(measured::direction | measured::angles)) return;
    bearings.push_back(&m);
  }
  const Gaussian noise{std::sqrt(double(bearings.size()))};  // all of them together: σ of a factor e
  for (const PlacedMeasurement* bearing : bearings) {
    const std::size_t k = bearing->keyframe;
    const TargetSensor& sensor = data.sensors[bearing->sensor];
    const Vector<3> marker = guess.pose[k].act(sensor.marker.translation());
    const double range = std::max(kMinRange, (odometry[k].act(sensor.mount.translation()) - marker).norm());
    const auto add = [&]<class X>(const X& x) {
      const G mount = in_group<G>(sensor.mount);
      const Vector<G::point_dim> beacon = in_group<G>(sensor.marker.translation());
      if constexpr (std::same_as<X, CourseVariable<G>>) {
        const SteadyCourse<LogRange<G>> on_course{{range, mount, beacon}, x.t};
        return problem.minimize(on_course, noise, {chaser[k], x.first, x.speed});
      } else if constexpr (std::same_as<X, Variable<Point>>) {
        return problem.minimize(LogRange<G, Point>{range, mount, beacon}, noise, {chaser[k], x});
      } else {
        return problem.minimize(LogRange<G>{range, mount, beacon}, noise, {chaser[k], x});
      }
    };
    const Block block = std::visit(add, target[k]);
    if (!out.assumed_range) out.assumed_range = AssumedRange{block, bearing->sensor, k};
  }
}

template void TrackingBuild<SE3>::assume_range();
template void TrackingBuild<SE2>::assume_range();

}  // namespace tandem::detail
