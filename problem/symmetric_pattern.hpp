#pragma once

#include <vector>

#include <Eigen/Core>

namespace tandem {

/// Sparsity pattern and memory layout of a symmetric matrix, by blocks of one variable each. Only one block of each
/// pair (i, j), (j, i) is stored, the one whose column comes first. Diagonal blocks are stored in full. Values of a
/// block column are stored column by column. Indices have 32 bits.
struct SymmetricPattern {
  /// Block k has the unknowns first[k] … first[k + 1] − 1.
  std::vector<int> first;
  /// Block column k has the block rows block_row[block_start[k]] … block_row[block_start[k + 1] − 1]: first k itself,
  /// then the others in the order of their columns. block_offset is the index of the first entry of a block row within
  /// each column.
  std::vector<int> block_start, block_row, block_offset;
  /// Index of the first value of each block column; the last entry is the number of values.
  std::vector<int> value_start;

  /// Position of each block column in the elimination order, for a pattern that contains the blocks of its Cholesky
  /// factor. Empty if the pattern contains only the blocks of the problem, in the order of the variables; scalar sparse
  /// solvers need this form.
  std::vector<int> place;
  /// Ends of two parts at the beginning of the elimination order that are not coupled with each other, 0 if there are
  /// none.
  int first_part = 0, second_part = 0;

  int size() const { return first.back(); }
  int num_blocks() const { return static_cast<int>(first.size()) - 1; }
  Eigen::Index nonzeros() const { return value_start.back(); }
  int width(int block) const { return first[std::size_t(block) + 1] - first[std::size_t(block)]; }
  /// Returns the number of values in each column of a block column.
  int height(int block) const {
    const int last = block_start[std::size_t(block) + 1] - 1;
    return block_offset[std::size_t(last)] + width(block_row[std::size_t(last)]);
  }
  /// Returns the index of the value of diagonal entry i of a block.
  int diagonal(int block, int i) const { return value_start[std::size_t(block)] + i * (height(block) + 1); }
  /// Location of a block in the values.
  struct BlockPlace {
    int entry;        ///< index in block_row and block_offset
    int first_value;  ///< index of the first value
    int stride;       ///< distance between the columns of the block
    bool transposed;  ///< the pattern stores the transpose of the block
  };
  /// Returns the location of the block with the given block row and block column, which must be in the pattern.
  BlockPlace find(int block_of_rows, int block_of_columns) const;
  /// Return the column starts and row indices of the scalar matrix. Without `place` they are a compressed-column
  /// format. They take a third of the memory of the Hessian, so solvers that work on blocks avoid them.
  std::vector<int> column_starts() const;
  std::vector<int> rows() const;
  /// Computes block_offset and value_start from the other members. Throws Error, naming the matrix `what`, if there are
  /// more than 2^31 values.
  void place_values(const char* what);
};

}  // namespace tandem
