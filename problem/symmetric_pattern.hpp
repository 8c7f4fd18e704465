#pragma once

#include <vector>

#include <Eigen/Core>

namespace tandem {

/// Where the values of a symmetric Hessian stand, by blocks of one variable each: of a pair of blocks the one whose column
/// comes first has the other as rows, and its own diagonal block in full. 32-bit indices.
struct SymmetricPattern {
  /// The unknowns of block k are first[k] … first[k + 1] − 1.
  std::vector<int> first;
  /// Block column k has the block rows block_row[block_start[k]] …, k itself first, the others in the order in which their
  /// own columns come; block_offset is the first of a block row's entries within a column.
  std::vector<int> block_start, block_row, block_offset;
  /// The first value of each block column, whose columns stand one after the other; and at the end the number of values.
  std::vector<int> value_start;

  /// Of a pattern that has all blocks of its own Cholesky factor, in the order of elimination: each block's place in that.
  /// Empty of one with nothing but what the problem has, whose columns come in the order of the variables: solvers entry by
  /// entry take such a one.
  std::vector<int> place;
  /// Ends of two parts at the beginning of that order of which neither has a row in the other; 0 where there are none.
  int first_part = 0, second_part = 0;

  int size() const { return first.back(); }
  int num_blocks() const { return static_cast<int>(first.size()) - 1; }
  Eigen::Index nonzeros() const { return value_start.back(); }
  int width(int block) const { return first[std::size_t(block) + 1] - first[std::size_t(block)]; }
  /// Values of each column of a block.
  int height(int block) const {
    const int last = block_start[std::size_t(block) + 1] - 1;
    return block_offset[std::size_t(last)] + width(block_row[std::size_t(last)]);
  }
  /// Where the i-th entry of a block's diagonal stands.
  int diagonal(int block, int i) const { return value_start[std::size_t(block)] + i * (height(block) + 1); }
  /// Where a block of the matrix stands, or its transpose where that is what the pattern has.
  struct BlockPlace {
    int entry;        ///< of block_row and block_offset
    int first_value;  ///< of the block there
    int stride;       ///< from one column of it to the next
    bool transposed;
  };
  /// Of the block with these rows and columns, each the unknowns of one block. The pattern has it.
  BlockPlace find(int block_of_rows, int block_of_columns) const;
  /// Where the first value of each unknown's column is, and the number of values at the end; and the row of each value.
  /// Without `place`, as compressed columns: solvers by blocks do without, for whom they would be a third of the Hessian again.
  std::vector<int> column_starts() const;
  std::vector<int> rows() const;
  /// Sets block_offset and value_start from the rest. Throws Error where there are more than 2^31 values, of `what`.
  void place_values(const char* what);
};

}  // namespace tandem
