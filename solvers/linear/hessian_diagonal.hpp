#pragma once

#include <tandem/problem/program.hpp>

namespace tandem::detail {

/// The diagonal of a Hessian given by its pattern's values, of these blocks: the curvature of each unknown.
inline void hessian_diagonal(const SymmetricPattern& pattern, int first, int end, const Eigen::VectorXd& values,
                             Eigen::VectorXd& diagonal) {
  for (int k = first; k < end; ++k)
    for (int i = 0, at = pattern.diagonal(k, 0), stride = pattern.height(k) + 1; i < pattern.width(k);
         ++i, at += stride)
      diagonal[pattern.first[std::size_t(k)] + i] = values[at];
}

/// The same of all.
inline void hessian_diagonal(const SymmetricPattern& pattern, const Eigen::VectorXd& values,
                             Eigen::VectorXd& diagonal) {
  hessian_diagonal(pattern, 0, pattern.num_blocks(), values, diagonal);
}

}  // namespace tandem::detail
