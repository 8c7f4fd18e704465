#include <tandem/problem/tracking/sensor_build.hpp>
#include <tandem/residuals/bearing.hpp>

namespace tandem {

struct PlaceBearing {
  template <LieGroup G, LieGroup T>
  static Bearing<G, T> residual(const Measurement& m, const G& mount, const Vector<G::point_dim>& beacon) {
    return {detail::direction_of<G>(m), mount, beacon};
  }
};

namespace detail {
template void place<PlaceBearing, SE3>(TrackingBuild<SE3>&, const Placing&);
template void place<PlaceBearing, SE2>(TrackingBuild<SE2>&, const Placing&);
}  // namespace detail

}  // namespace tandem
