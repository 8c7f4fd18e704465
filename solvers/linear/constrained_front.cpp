#include <algorithm>

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include <tandem/solvers/linear/constrained_front.hpp>

namespace tandem::detail {
namespace {

/// Reduces the rows to at most as many as columns, and drops rows below the tolerance.
Eigen::MatrixXd compressed(Eigen::MatrixXd rows) {
  if (rows.rows() > rows.cols() && rows.cols() > 0) {
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(rows);
    rows = Eigen::MatrixXd(qr.matrixQR().topRows(rows.cols()).triangularView<Eigen::Upper>());
  }
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    if (rows.row(i).norm() > ConstrainedFront::tolerance) rows.row(kept++) = rows.row(i).eval();
  return rows.topRows(kept);
}

}  // namespace

ConstrainedFront::ConstrainedFront(const Eigen::Ref<const Eigen::MatrixXd>& panel, const Eigen::MatrixXd& constraints) {
  const Eigen::Index m = panel.rows(), n = panel.cols(), below = m - n;

  // M = Q [R B1; 0 B2] with R of full row rank. R f + B1 s = 0 constrains f, and B2 s = 0 remains.
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(constraints.leftCols(n));
  const Eigen::MatrixXd& packed = qr.matrixQR();
  Eigen::Index rank = 0;
  while (rank < std::min(packed.rows(), n) && std::abs(packed(rank, rank)) > tolerance) ++rank;
  Eigen::MatrixXd turned = constraints.rightCols(below);
  if (below > 0) {  // Eigen fails for blocks without columns
    turned.applyOnTheLeft(qr.householderQ().adjoint());
    remaining = compressed(turned.bottomRows(turned.rows() - rank));
  }
  const Eigen::MatrixXd R =
      Eigen::MatrixXd(packed.topRows(rank).triangularView<Eigen::Upper>()) * qr.colsPermutation().transpose();

  // R = [Uᵀ 0] Vᵀ, hence f = V₁ (−U⁻ᵀ B1 s) + V₂ y = G s + Z y.
  Eigen::MatrixXd V = Eigen::MatrixXd::Identity(n, n), held = turned.topRows(rank);
  if (rank > 0) {
    const Eigen::HouseholderQR<Eigen::MatrixXd> range(R.transpose());
    V = range.householderQ();
    if (below > 0) range.matrixQR().topRows(rank).triangularView<Eigen::Upper>().transpose().solveInPlace(held);
  }
  const Eigen::MatrixXd G = -V.leftCols(rank) * held;
  directions = V.rightCols(n - rank);
  const auto& Z = directions;

  const Eigen::MatrixXd H = panel.topRows(n).selfadjointView<Eigen::Lower>();
  const Eigen::MatrixXd HG = H * G, C = panel.bottomRows(below).transpose();
  const Eigen::MatrixXd reduced = Z.transpose() * H * Z;
  const Eigen::LLT<Eigen::MatrixXd> llt(reduced);
  pivots = llt.matrixLLT().diagonal().cwiseAbs2();
  if (reduced.size() > 0 && llt.info() != Eigen::Success) {
    positive = false;
    return;
  }
  Eigen::MatrixXd W = Z.transpose() * (HG + C), root = Z.transpose();
  if (reduced.size() > 0) {
    if (below > 0) llt.matrixL().solveInPlace(W);  // Eigen fails for an empty right-hand side
    llt.matrixL().solveInPlace(root);
  }
  Tt = G.transpose() - W.transpose() * root;
  D = root.transpose() * root;

  // H of s increases by Gᵀ H G + Gᵀ C + Cᵀ G = Gᵀ K + Kᵀ G and decreases by Wᵀ W.
  const Eigen::MatrixXd K = C + 0.5 * HG;
  const Eigen::Index free = W.rows();
  A.setZero(m, free + 2 * n);
  A.bottomRows(below) << W.transpose(), -G.transpose(), -K.transpose();
  B.setZero(m, free + 2 * n);
  B.bottomRows(below) << W.transpose(), K.transpose(), G.transpose();
  added = (G.cwiseProduct(HG)).colwise().sum().transpose().cwiseMax(0.0);
}

}  // namespace tandem::detail
