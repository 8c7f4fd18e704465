#pragma once

#include <map>
#include <vector>

#include <Eigen/Core>

#include <tandem/solvers/active_rows.hpp>

namespace tandem::detail {

/// Blocks of S, the inverse of H on the null space of the active rows A, from a factor of M:
///
///   S ≈ M⁻¹ − M⁻¹ Aᵀ W A M⁻¹
///
/// This is one step of the method of multipliers. Relative to M⁻¹, the error is the square of the relative distance of
/// M⁻¹ from S. The columns are kept for further blocks.
class ConstrainedInverse {
 public:
  /// Returns the rows and columns of S of these blocks of the factor, in this order.
  Eigen::MatrixXd of(const BlockCholesky& factor, const ActiveRows& rows, const std::vector<int>& blocks);
  /// Must be called when the factor or the rows have changed.
  void clear() { *this = {}; }

 private:
  void add(const BlockCholesky& factor, const ActiveRows& rows, const std::vector<int>& blocks);

  struct Columns {
    BlockCholesky::Columns inverse, white;  // M⁻¹ E and W^½ A M⁻¹ E, where E selects unknowns
  };
  struct Column {
    int unknown;
    std::size_t request;
    Eigen::Index at;  // in the columns of the request
  };
  std::map<int, int> first_column_;  // by block
  std::vector<Column> columns_;
  std::vector<Columns> requests_;
  Eigen::MatrixXd selected_;  // the rows of S of the columns
};

}  // namespace tandem::detail
