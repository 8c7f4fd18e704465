#pragma once

#include <tandem/problem/program.hpp>

namespace tandem::detail {

/// The diagonal of a Hessian given by its pattern's values: the curvature of each unknown.
inline void hessian_diagonal(const SymmetricPattern& pattern, const Eigen::VectorXd& values,
                             Eigen::VectorXd& diagonal) {
  for (int k = 0; k < pattern.num_blocks(); ++k)
    for (int u = pattern.first[std::size_t(k)]; u < pattern.first[std::size_t(k) + 1]; ++u)
      diagonal[u] = values[pattern.column_start[std::size_t(u)] + u - pattern.first[std::size_t(k)]];
}

}  // namespace tandem::detail
