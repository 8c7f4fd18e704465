#pragma once

#include <Eigen/Core>

// Eigen's alignment and allocation of memory depend on the instruction set of the compiler and are part of Tandem's
// binary interface. The CMake targets and pkg-config set the flags for all instruction sets.
static_assert(EIGEN_MAX_ALIGN_BYTES == 16 && EIGEN_MAX_STATIC_ALIGN_BYTES == 16 && EIGEN_DEFAULT_ALIGN_BYTES == 16,
              "Eigen's memory layout differs from that of the Tandem library: use the flags of the CMake target "
              "tandem::lie or of 'pkg-config --cflags tandem'");

namespace tandem {

/// Fixed-size column vector and matrix; every size in the evaluation path is known to the compiler.
template <int N, class S = double>
using Vector = Eigen::Matrix<S, N, 1>;
template <int Rows, int Cols, class S = double>
using Matrix = Eigen::Matrix<S, Rows, Cols>;

}  // namespace tandem
