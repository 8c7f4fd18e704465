#include <cmath>
#include <limits>
#include <vector>

#include <tandem/problem/elimination.hpp>

namespace tandem::detail {

EliminatedQuadratic eliminate(const Eigen::MatrixXd& H, const Eigen::VectorXd& g, double cost, int eliminated) {
  const int n = static_cast<int>(H.rows());
  const double rounding = 10.0 * n * std::numeric_limits<double>::epsilon();
  // Columns of the factor in pivot order; rows in the order of H, g last. Rows are not permuted: a row is zero in all
  // columns after its own pivot.
  Eigen::MatrixXd L(n + 1, n);
  Eigen::VectorXd left = H.diagonal(), column(n + 1);
  std::vector<char> done(std::size_t(n), 0);
  int rank = 0;
  const auto factor = [&](int begin, int end) {
    const int rows = n + 1 - begin;
    for (int step = begin; step < end; ++step) {
      int pivot = -1;
      double largest = rounding;
      for (int i = begin; i < end; ++i) {
        if (done[std::size_t(i)] || !(left[i] > largest * H(i, i))) continue;
        largest = left[i] / H(i, i);
        pivot = i;
      }
      if (pivot < 0) return;
      auto c = column.tail(rows);
      c.head(rows - 1) = H.col(pivot).tail(rows - 1);
      c[rows - 1] = g[pivot];
      c.noalias() -= L.block(begin, 0, rows, rank) * L.row(pivot).head(rank).transpose();
      c /= std::sqrt(left[pivot]);
      column[pivot] = std::sqrt(left[pivot]);
      for (int i = begin; i < n; ++i) {
        if (done[std::size_t(i)]) column[i] = 0;
        left[i] -= column[i] * column[i];
      }
      L.col(rank++).tail(rows) = c;
      done[std::size_t(pivot)] = 1;
    }
  };
  factor(0, eliminated);
  const int first = rank;
  factor(eliminated, n);
  EliminatedQuadratic result;
  result.A = L.block(eliminated, first, n - eliminated, rank - first).transpose();
  result.b = L.row(n).segment(first, rank - first).transpose();
  result.constant = cost - 0.5 * L.row(n).head(rank).squaredNorm();
  return result;
}

}  // namespace tandem::detail
