#pragma once

#include <span>
#include <utility>
#include <vector>

#include <tandem/problem/program.hpp>

namespace tandem::detail {

/// The block structure of a Cholesky factor in some elimination order.
struct BlockSymbolic {
  std::vector<int> order;           ///< block of the pattern at each place
  std::vector<int> row_start, row;  ///< block rows (places) of each block column, ascending, itself first
  double nonzeros = 0, flops = 0;
};

/// The blocks of a pattern (first, block_start and block_row alone) and those of further pairs of its variables.
SymmetricPattern blocks_with(const SymmetricPattern& pattern, std::span<const std::pair<int, int>> pairs);

/// SuiteSparse's AMD order, or the natural one where that takes at most `natural_flops` times the arithmetic to factorise.
BlockSymbolic analyze(const SymmetricPattern& pattern, double natural_flops);

}  // namespace tandem::detail
