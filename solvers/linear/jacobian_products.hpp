#pragma once

#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem::detail {

/// Adds J x to `sum`. `values` are the entries of J in the order of `pattern`.
inline void add_jacobian_product(const TripletPattern& pattern, const Eigen::VectorXd& values, const Eigen::VectorXd& x,
                                 Eigen::VectorXd& sum) {
  for (std::size_t k = 0; k < pattern.row.size(); ++k)
    sum[pattern.row[k]] += values[Eigen::Index(k)] * x[pattern.column[k]];
}

/// Adds Jᵀ y to `sum`.
inline void add_transposed_product(const TripletPattern& pattern, const Eigen::VectorXd& values,
                                   const Eigen::VectorXd& y, Eigen::VectorXd& sum) {
  for (std::size_t k = 0; k < pattern.row.size(); ++k)
    sum[pattern.column[k]] += values[Eigen::Index(k)] * y[pattern.row[k]];
}

}  // namespace tandem::detail
