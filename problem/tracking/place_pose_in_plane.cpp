#include <tandem/problem/tracking/place_pose.hpp>

namespace tandem::detail {

template <>
void place<PlacePose, SE2>(TrackingBuild<SE2>& build, const Placing& at) {
  place_pose(build, at);
}

}  // namespace tandem::detail
