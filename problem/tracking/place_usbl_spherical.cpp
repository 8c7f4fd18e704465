#include <tandem/problem/tracking/sensor_build.hpp>
#include <tandem/residuals/usbl_spherical.hpp>

namespace tandem {

struct PlaceUsblSpherical {
  template <LieGroup G, LieGroup T>
  static UsblSpherical<G, T> residual(const Measurement& m, const G& mount, const Vector<G::point_dim>& beacon) {
    return {m.range, m.azimuth, m.elevation, mount, beacon};
  }
};

namespace detail {
template void place<PlaceUsblSpherical, SE3>(TrackingBuild<SE3>&, const Placing&);
}  // namespace detail

}  // namespace tandem
