#pragma once

#include <Eigen/Core>

namespace tandem {

/// Fixed-size column vector and matrix; every size in the evaluation path is known to the compiler.
template <int N, class S = double>
using Vector = Eigen::Matrix<S, N, 1>;
template <int Rows, int Cols, class S = double>
using Matrix = Eigen::Matrix<S, Rows, Cols>;

}  // namespace tandem
