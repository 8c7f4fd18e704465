#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <tandem/problem/tracking/carried_covariance.hpp>

namespace tandem::detail {
namespace {

/// Of terms that make a position's variance: what rounding leaves of terms that should cancel is as much of them.
constexpr double kMostCancelled = 1e8;

}  // namespace

CarriedCovariance::CarriedCovariance(const Given& covariance, int chaser, int before)
    : P_(covariance), chaser_(chaser), before_(before) {}

bool CarriedCovariance::carry(const Given& by, const Given& noise, int positions) {
  const Eigen::Index C = chaser_, D = before_, M = by.rows(), T = D + M;
  const Vector terms = by.cwiseAbs2().lazyProduct(P_.diagonal().tail(T));
  const Matrix cross = by.lazyProduct(P_.bottomRows(T));
  const Matrix of_chaser = P_.block(0, C + D, C, D), before = P_.block(C + D, C + D, D, D);
  P_.block(0, C, C, D) = of_chaser;
  P_.block(C, 0, D, C) = of_chaser.transpose();
  P_.block(C, C, D, D) = before;
  P_.bottomLeftCorner(M, C) = cross.leftCols(C);
  P_.block(C + D, C, M, D) = cross.middleCols(C + D, D);
  P_.topRightCorner(C + D, M) = P_.bottomLeftCorner(M, C + D).transpose();
  // Symmetric to the last bit, or rounding would grow with each step.
  const Matrix own = cross.rightCols(T).lazyProduct(by.transpose());
  P_.bottomRightCorner(M, M) = 0.5 * (own + own.transpose()) + noise;
  const auto left = P_.diagonal().segment(C + D, positions).array();
  return (terms.head(positions).array() <= kMostCancelled * left).all();
}

bool CarriedCovariance::carry(const Given& next, const Given& by, const Given& noise, int positions) {
  // Copies of what is bounded, for results that are, and do not ask the heap.
  const Eigen::PartialPivLU<Matrix> root(next);
  const Matrix step = -root.solve(Matrix(by)), half = root.solve(Matrix(noise)).transpose();
  return carry(step, Matrix(root.solve(half)), positions);
}

CarriedCovariance::Vector CarriedCovariance::take_in(const GivenVector& r, int first, const Given& J,
                                                     const GivenVector& sigma) {
  const Eigen::Index read = chaser_ + first, count = J.cols();
  const Matrix PJ = P_.middleCols(read, count).lazyProduct(J.transpose());
  Matrix S = J.lazyProduct(PJ.middleRows(read, count));
  S.diagonal() += sigma.cwiseAbs2();
  const Eigen::LLT<Matrix> root(S);
  const Matrix gain = root.matrixL().solve(PJ.transpose());
  P_ -= gain.transpose().lazyProduct(gain);
  return -gain.rightCols(P_.cols() - chaser_).transpose().lazyProduct(Vector(root.matrixL().solve(Vector(r))));
}

CarriedCovariance::Matrix CarriedCovariance::of_newest(const Given& by) const {
  const Eigen::Index C = chaser_, P = by.rows(), now = chaser_ + before_, M = by.cols();
  Matrix result(C + P, C + P);
  result.topLeftCorner(C, C) = P_.topLeftCorner(C, C);
  result.bottomLeftCorner(P, C) = by.lazyProduct(P_.block(now, 0, M, C));
  result.topRightCorner(C, P) = result.bottomLeftCorner(P, C).transpose();
  const Matrix cross = by.lazyProduct(P_.block(now, now, M, M));
  result.bottomRightCorner(P, P) = cross.lazyProduct(by.transpose());
  return result;
}

}  // namespace tandem::detail
