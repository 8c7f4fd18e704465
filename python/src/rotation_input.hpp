#pragma once

#include <functional>
#include <string>

#include "elements.hpp"

namespace tandem::python {

/// Throws ValueError unless M is a rotation matrix within 1e-6.
template <int N>
Matrix<N, N> checked_rotation(const Matrix<N, N>& M, const std::string& what) {
  if (!(M.transpose() * M).isIdentity(1e-6) || M.determinant() < 0)
    throw py::value_error(what + ": the matrix is not a rotation (R' R = I and det R = 1, within 1e-6)");
  return M;
}

/// Throws ValueError unless the last row of T is 0 … 0 1 within 1e-6.
template <int N>
void check_last_row(const Matrix<N, N>& T, const std::string& what) {
  if (!((T.row(N - 1) - Vector<N>::Unit(N - 1).transpose()).cwiseAbs().maxCoeff() < 1e-6))
    throw py::value_error(what + ": the last row of the matrix is not 0 ... 0 1");
}

/// Converts rotations to elements: elements of SO3, rotation matrices, or a scipy Rotation.
Elements<SO3> rotations_in_space(py::handle value, const std::string& what);
/// Converts rotations in the plane: elements of SO2, angles [rad], or rotation matrices.
Elements<SO2> rotations_in_plane(py::handle value, const std::string& what);
/// Converts quaternions of the named order, "xyzw" or "wxyz".
Elements<SO3> rotations_of_quaternions(py::handle value, const std::string& order, const std::string& what);
/// Returns the quaternions in the named order.
Numbers quaternions(std::size_t count, bool single, const std::string& order, const std::string& what,
                    const std::function<Eigen::Quaterniond(std::size_t)>& of);

}  // namespace tandem::python
