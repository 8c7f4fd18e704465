#include <tandem/problem/tracking/sensor_build.hpp>

namespace tandem {

struct PlacePose;

namespace detail {

template <LieGroup G>
void place_pose(TrackingBuild<G>& build, const Placing& at) {
  if (at.fraction) {
    SensorBuild<G, true>(build, at).add_pose();
  } else {
    SensorBuild<G, false>(build, at).add_pose();
  }
}

template <>
void place<PlacePose, SE3>(TrackingBuild<SE3>& build, const Placing& at) {
  place_pose(build, at);
}
template <>
void place<PlacePose, SE2>(TrackingBuild<SE2>& build, const Placing& at) {
  place_pose(build, at);
}

}  // namespace detail
}  // namespace tandem
