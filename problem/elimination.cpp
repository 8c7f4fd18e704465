#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/QR>

#include <tandem/problem/elimination.hpp>

namespace tandem::detail {
namespace {

constexpr double kZeroRow = 1e-10;  // smaller entries of a row that had norm 1 count as rounding

/// Equations turned orthogonally so that the first `rank` rows are [R B] with R upper triangular and regular, up to a
/// permutation of the first columns, and the others are [0 B].
struct TurnedRows {
  Eigen::Index rank = 0;
  Eigen::MatrixXd R;  // rank × first columns
  LinearRows others;  // on the other columns; the first `rank` rows belong to R

  TurnedRows(const LinearRows& rows, Eigen::Index columns)
      : R(0, columns), others{rows.A.rightCols(rows.A.cols() - columns), rows.b} {
    if (columns == 0 || rows.A.rows() == 0) return;  // Eigen fails for these
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(rows.A.leftCols(columns));
    const Eigen::MatrixXd& packed = qr.matrixQR();
    while (rank < std::min(packed.rows(), columns) && std::abs(packed(rank, rank)) > kZeroRow) ++rank;
    R = Eigen::MatrixXd(packed.topRows(rank).triangularView<Eigen::Upper>()) * qr.colsPermutation().transpose();
    Eigen::MatrixXd turned(rows.A.rows(), rows.A.cols() - columns + 1);
    turned << rows.A.rightCols(rows.A.cols() - columns), rows.b;
    turned.applyOnTheLeft(qr.householderQ().adjoint());
    others = {turned.leftCols(turned.cols() - 1), turned.col(turned.cols() - 1)};
  }
};

/// Divides each row by its norm, and drops rows of zeros.
LinearRows normalized(const LinearRows& rows) {
  LinearRows result = rows;
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < rows.A.rows(); ++i) {
    const double norm = rows.A.row(i).norm();
    if (!(norm > 0)) continue;
    result.A.row(kept) = rows.A.row(i) / norm;
    result.b[kept++] = rows.b[i] / norm;
  }
  return {result.A.topRows(kept), result.b.head(kept)};
}

/// Returns equivalent rows that do not depend on each other, without the coefficients that are rounding errors.
LinearRows independent(const LinearRows& rows) {
  const TurnedRows turned(rows, rows.A.cols());
  LinearRows result{turned.R, turned.others.b.head(turned.rank)};
  result.A = (result.A.array().abs() > kZeroRow).select(result.A, 0.0);
  return result;
}

}  // namespace

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

EliminatedProgram eliminate(const Eigen::MatrixXd& H, const Eigen::VectorXd& g, double cost, int eliminated,
                            const LinearRows& equations) {
  const LinearRows rows = normalized(equations);
  if (rows.A.rows() == 0) return {eliminate(H, g, cost, eliminated), {Eigen::MatrixXd(0, H.rows() - eliminated), {}}};
  const Eigen::Index n = H.rows(), m = eliminated, kept = n - m;
  const TurnedRows turned(rows, m);
  const Eigen::Index rank = turned.rank, left = rows.A.rows() - rank;

  // R = [Uᵀ 0] Vᵀ, hence x = V₁ (−U⁻ᵀ (B₁ s + d₁)) + V₂ y.
  Eigen::MatrixXd V = Eigen::MatrixXd::Identity(m, m), held(rank, kept + 1);
  held << turned.others.A.topRows(rank), turned.others.b.head(rank);
  if (rank > 0) {
    const Eigen::HouseholderQR<Eigen::MatrixXd> range(turned.R.transpose());
    V = range.householderQ();
    range.matrixQR().topRows(rank).triangularView<Eigen::Upper>().transpose().solveInPlace(held);
  }
  const Eigen::MatrixXd determined = -V.leftCols(rank) * held;  // [G f]
  const Eigen::Index free = m - rank;
  // δ = T [y; s] + [f; 0] with T = [V₂ G; 0 I], of which only the upper rows are stored
  Eigen::MatrixXd upper(m, free + kept);
  upper << V.rightCols(free), determined.leftCols(kept);
  const Eigen::VectorXd f = determined.col(kept), Hf = H.leftCols(m) * f;

  const Eigen::MatrixXd HT = H.topLeftCorner(m, m) * upper;
  const Eigen::MatrixXd mixed = upper.transpose() * H.topRightCorner(m, kept);
  Eigen::MatrixXd reduced = upper.transpose() * HT;
  reduced.rightCols(kept) += mixed;
  reduced.bottomRows(kept) += mixed.transpose();
  reduced.bottomRightCorner(kept, kept) += H.bottomRightCorner(kept, kept);
  reduced = 0.5 * (reduced + reduced.transpose()).eval();
  Eigen::VectorXd gradient = upper.transpose() * (g + Hf).head(m);
  gradient.tail(kept) += (g + Hf).tail(kept);
  // Terms that cancel leave rounding errors, which are no information.
  Eigen::VectorXd terms = upper.cwiseAbs2().transpose() * H.diagonal().head(m);
  terms.tail(kept) += H.diagonal().tail(kept);
  const double rounding = 10.0 * double(n) * std::numeric_limits<double>::epsilon();
  for (Eigen::Index i = 0; i < reduced.rows(); ++i) {
    if (reduced(i, i) > rounding * terms[i]) continue;
    reduced.row(i).setZero();
    reduced.col(i).setZero();
    gradient[i] = 0;
  }
  const double at_f = cost + g.head(m).dot(f) + 0.5 * f.dot(Hf.head(m));
  LinearRows remaining{Eigen::MatrixXd(0, kept), {}};
  if (left > 0 && kept > 0) remaining = independent({turned.others.A.bottomRows(left), turned.others.b.tail(left)});
  return {eliminate(reduced, gradient, at_f, static_cast<int>(free)), std::move(remaining)};
}

}  // namespace tandem::detail
