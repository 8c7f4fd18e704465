#include <tandem/problem/tracking/sensor_build.hpp>
#include <tandem/residuals/range.hpp>

namespace tandem {

struct PlaceRange {
  template <LieGroup G, LieGroup T>
  static Range<G, T> residual(const Measurement& m, const G& mount, const Vector<G::point_dim>& beacon) {
    return {m.range, mount, beacon};
  }
};

namespace detail {
template void place<PlaceRange, SE3>(TrackingBuild<SE3>&, const Placing&);
template void place<PlaceRange, SE2>(TrackingBuild<SE2>&, const Placing&);
}  // namespace detail

}  // namespace tandem
