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

/// SuiteSparse's AMD order, or the natural one where that costs hardly more to factorise.
BlockSymbolic analyze(const SymmetricPattern& pattern);

}  // namespace tandem::detail
