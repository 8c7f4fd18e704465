#pragma once

#include <vector>

#include <tandem/problem/program.hpp>

namespace tandem::detail {

/// The block structure of a Cholesky factor in some elimination order.
struct BlockSymbolic {
  std::vector<int> order;           ///< block of the pattern at each place
  std::vector<int> row_start, row;  ///< block rows (places) of each block column, ascending, itself first
  double nonzeros = 0, flops = 0;
};

/// Natural order or SuiteSparse's AMD, whichever costs less to factorise; the natural one when they tie.
BlockSymbolic analyze(const SymmetricPattern& pattern);

}  // namespace tandem::detail
