#include <tandem/residuals/sensor_frame.hpp>
#include <tandem/residuals/sensor_frame_curvature.hpp>

namespace tandem {

template Vector<3> in_sensor_frame(const SE3&, const SE3&, const SE3&, const Vector<3>&, RowsBy<3, SE3>*,
                                   RowsBy<3, SE3>*);
template Vector<3> in_sensor_frame(const SE3&, const R3&, const SE3&, const Vector<3>&, RowsBy<3, SE3>*,
                                   RowsBy<3, R3>*);
template Vector<2> in_sensor_frame(const SE2&, const SE2&, const SE2&, const Vector<2>&, RowsBy<2, SE2>*,
                                   RowsBy<2, SE2>*);
template Vector<2> in_sensor_frame(const SE2&, const Rn<2>&, const SE2&, const Vector<2>&, RowsBy<2, SE2>*,
                                   RowsBy<2, Rn<2>>*);

namespace detail {
template void curvature_in_sensor_frame(const SE3&, const SE3&, const SE3&, const Vector<3>&, const Vector<3>&,
                                        Matrix<12, 12>&);
template void curvature_in_sensor_frame(const SE3&, const R3&, const SE3&, const Vector<3>&, const Vector<3>&,
                                        Matrix<9, 9>&);
template void curvature_of_observed(const SE3&, const SE3&, const SE3&, const Vector<3>&, const Vector<3>&,
                                    const Matrix<3, 3>&, Matrix<12, 12>&);
template void curvature_of_observed(const SE3&, const R3&, const SE3&, const Vector<3>&, const Vector<3>&,
                                    const Matrix<3, 3>&, Matrix<9, 9>&);
}  // namespace detail

}  // namespace tandem
