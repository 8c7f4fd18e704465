#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <Eigen/SparseLU>

namespace tandem::detail {

/// Sparse LU factorisation with partial pivoting of a symmetric indefinite matrix. It is slower than a Cholesky
/// factorisation of a condensed matrix, but accurate for pivots of any size and sign. The matrix is scaled
/// symmetrically, so that the largest entry of each row is about 1.
class PivotedKkt {
 public:
  /// Sets the triplets of one triangle of an n × n matrix, whose indices start at `base`. Duplicates are summed.
  void set_pattern(int n, int entries, const int* row, const int* column, int base);
  /// Factorises the matrix with these values of the triplets, after `added` has been added to its diagonal. Returns
  /// false if it is singular.
  bool factorize(const double* values, const Eigen::VectorXd& added);
  /// Overwrites the right-hand side by the solution.
  void solve(Eigen::Ref<Eigen::VectorXd> rhs);

 private:
  std::vector<int> row_, column_;
  int n_ = 0;
  Eigen::SparseMatrix<double> matrix_;
  Eigen::VectorXd scale_, solution_;
  Eigen::SparseLU<Eigen::SparseMatrix<double>> lu_;
};

}  // namespace tandem::detail
