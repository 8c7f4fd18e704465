#include <tandem/residuals/interpolated.hpp>

namespace tandem {

template SE3 interpolate(const SE3&, const SE3&, const double&, SE3::Jacobian*, SE3::Jacobian*);
template SE2 interpolate(const SE2&, const SE2&, const double&, SE2::Jacobian*, SE2::Jacobian*);
template R3 interpolate(const R3&, const R3&, const double&, R3::Jacobian*, R3::Jacobian*);
template Rn<2> interpolate(const Rn<2>&, const Rn<2>&, const double&, Rn<2>::Jacobian*, Rn<2>::Jacobian*);

}  // namespace tandem
