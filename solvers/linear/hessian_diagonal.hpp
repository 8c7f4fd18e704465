#pragma once

#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem::detail {

/// Copies the diagonal of a Hessian, given by the values of its pattern, for the blocks from `first` to before `end`.
inline void hessian_diagonal(const SymmetricPattern& pattern, int first, int end, const Eigen::VectorXd& values,
                             Eigen::VectorXd& diagonal) {
  for (int k = first; k < end; ++k)
    for (int i = 0, at = pattern.diagonal(k, 0), stride = pattern.height(k) + 1; i < pattern.width(k);
         ++i, at += stride)
      diagonal[pattern.first[std::size_t(k)] + i] = values[at];
}

/// Returns the smallest curvature that constraints divide by: 1e-8 of the largest one, or 1 if none is positive.
inline double min_curvature(const Eigen::VectorXd& curvature) {
  const double largest = curvature.maxCoeff();
  return largest > 0 ? 1e-8 * largest : 1.0;
}

/// Copies the whole diagonal.
inline void hessian_diagonal(const SymmetricPattern& pattern, const Eigen::VectorXd& values,
                             Eigen::VectorXd& diagonal) {
  hessian_diagonal(pattern, 0, pattern.num_blocks(), values, diagonal);
}

}  // namespace tandem::detail
