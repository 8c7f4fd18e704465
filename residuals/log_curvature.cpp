#include <tandem/residuals/carried_twist_curvature.hpp>
#include <tandem/residuals/log_curvature.hpp>

namespace tandem::detail {

template void curvature_of_between<SE3>(const SE3&, const SE3::Tangent&, const SE3::Tangent&, const SE3::Tangent&,
                                        const SE3::Jacobian&, const SE3::Jacobian&, Matrix<12, 12>&);
template void curvature_of_carried_twist<SE3, true>(const SE3&, const SE3&, const SE3&, const SE3::Tangent&,
                                                    const SE3::Tangent&, const SE3::Tangent&, Matrix<18, 18>&);
template void curvature_of_carried_twist<SE3, false>(const SE3&, const SE3&, const SE3&, const SE3::Tangent&,
                                                     const SE3::Tangent&, const SE3::Tangent&, Matrix<18, 18>&);

}  // namespace tandem::detail
