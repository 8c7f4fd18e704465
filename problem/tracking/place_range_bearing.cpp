#include <tandem/problem/tracking/sensor_build.hpp>
#include <tandem/residuals/range_bearing.hpp>

namespace tandem {

struct PlaceRangeBearing {
  template <LieGroup G, LieGroup T>
  static RangeBearing<G, T> residual(const Measurement& m, const G& mount, const Vector<G::point_dim>& beacon) {
    return {m.range, detail::direction_of<G>(m), mount, beacon};
  }
};

namespace detail {
template void place<PlaceRangeBearing, SE3>(TrackingBuild<SE3>&, const Placing&);
template void place<PlaceRangeBearing, SE2>(TrackingBuild<SE2>&, const Placing&);
}  // namespace detail

}  // namespace tandem
