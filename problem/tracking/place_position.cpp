#include <tandem/problem/tracking/sensor_build.hpp>
#include <tandem/residuals/usbl_position.hpp>

namespace tandem {

struct PlacePosition {
  template <LieGroup G, LieGroup T>
  static UsblPosition<G, T> residual(const Measurement& m, const G& mount, const Vector<G::point_dim>& beacon) {
    return {in_group<G>(m.position), mount, beacon};
  }
};

namespace detail {
template void place<PlacePosition, SE3>(TrackingBuild<SE3>&, const Placing&);
template void place<PlacePosition, SE2>(TrackingBuild<SE2>&, const Placing&);
}  // namespace detail

}  // namespace tandem
