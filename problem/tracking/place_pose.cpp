#include <tandem/problem/tracking/place_pose.hpp>

namespace tandem::detail {

template <>
void place<PlacePose, SE3>(TrackingBuild<SE3>& build, const Placing& at) {
  place_pose(build, at);
}

}  // namespace tandem::detail
