#pragma once

#include <span>
#include <utility>
#include <vector>

#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem::detail {

/// Block structure of a Cholesky factor for an elimination order.
struct BlockSymbolic {
  std::vector<int> order;           ///< block of the pattern at each place in the order
  std::vector<int> row_start, row;  ///< block rows (places) of each block column, ascending, itself first
  double flops = 0;
  /// Ends of two leading parts without rows in each other; 0 if there are none.
  int first_part = 0, second_part = 0;
};

/// Returns the block structure (first, block_start and block_row only) of a pattern with additional pairs of variables.
SymmetricPattern blocks_with(const SymmetricPattern& pattern, std::span<const std::pair<int, int>> pairs);

/// Minimum number of blocks for elimination from both ends.
inline constexpr int kMinBlocksForBothEnds = 200;
/// Minimum number of entries of a factor for two threads.
inline constexpr double kMinEntriesForThreads = 5e4;

/// Returns the AMD order, or the natural one if that needs at most `natural_flops` times the arithmetic. With
/// `both_ends`, a long chain is eliminated from both ends, in two parts for two threads.
BlockSymbolic analyze(const SymmetricPattern& pattern, double natural_flops, bool both_ends);

/// Returns the pattern of a factor with this structure, with values stored as the factor stores them. Throws Error if
/// it has more than 2³¹ entries.
SymmetricPattern in_elimination_order(const SymmetricPattern& pattern, const BlockSymbolic& structure);

}  // namespace tandem::detail
