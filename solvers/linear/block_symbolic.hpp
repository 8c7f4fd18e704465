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
  double flops = 0;
  /// Ends of two parts at the beginning of the order of which neither has a row in the other; 0 where there are none.
  int first_part = 0, second_part = 0;
};

/// The blocks of a pattern (first, block_start and block_row alone) and those of further pairs of its variables.
SymmetricPattern blocks_with(const SymmetricPattern& pattern, std::span<const std::pair<int, int>> pairs);

/// Blocks from which a chain is eliminated from both ends.
inline constexpr int kLongChain = 200;
/// Entries of a factor from which two threads gain more than it takes to start them.
inline constexpr double kWorthThreads = 5e4;

/// SuiteSparse's AMD order, or the natural one where that takes at most `natural_flops` times the arithmetic to factorise: for a
/// long chain, where `both_ends` allows, from both its ends towards the middle, in two parts for as many threads.
BlockSymbolic analyze(const SymmetricPattern& pattern, double natural_flops, bool both_ends);

/// The pattern of the factor that has this structure: of the given one's values, each in its place there. Throws Error where
/// that has more than 2^31.
SymmetricPattern in_order_of_elimination(const SymmetricPattern& pattern, const BlockSymbolic& structure);

}  // namespace tandem::detail
