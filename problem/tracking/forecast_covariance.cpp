#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <tandem/problem/tracking/forecast_covariance.hpp>

namespace tandem::detail {
namespace {

/// Maximum ratio of the largest term of a position variance to the variance. Above it, rounding errors dominate the
/// variance because the terms cancel.
constexpr double kMaxCancellation = 1e8;

}  // namespace

ForecastCovariance::ForecastCovariance(const Given& covariance, int chaser, int before)
    : P_(covariance), chaser_(chaser), before_(before) {}

bool ForecastCovariance::predict(const Given& J, const Given& noise, int positions) {
  const Eigen::Index C = chaser_, D = before_, M = J.rows(), T = D + M;
  const Vector terms = J.cwiseAbs2().lazyProduct(P_.diagonal().tail(T));
  const Matrix cross = J.lazyProduct(P_.bottomRows(T));
  const Matrix of_chaser = P_.block(0, C + D, C, D), before = P_.block(C + D, C + D, D, D);
  P_.block(0, C, C, D) = of_chaser;
  P_.block(C, 0, D, C) = of_chaser.transpose();
  P_.block(C, C, D, D) = before;
  P_.bottomLeftCorner(M, C) = cross.leftCols(C);
  P_.block(C + D, C, M, D) = cross.middleCols(C + D, D);
  P_.topRightCorner(C + D, M) = P_.bottomLeftCorner(M, C + D).transpose();
  // Symmetrises the result exactly; otherwise rounding errors grow with each step.
  const Matrix own = cross.rightCols(T).lazyProduct(J.transpose());
  P_.bottomRightCorner(M, M) = 0.5 * (own + own.transpose()) + noise;
  const auto variance = P_.diagonal().segment(C + D, positions).array();
  return (terms.head(positions).array() <= kMaxCancellation * variance).all();
}

bool ForecastCovariance::predict(const Given& J_next, const Given& J, const Given& noise, int positions) {
  // Arguments are copied into matrices of bounded size, so that the results do not allocate.
  const Eigen::PartialPivLU<Matrix> root(J_next);
  const Matrix step = -root.solve(Matrix(J)), half = root.solve(Matrix(noise)).transpose();
  return predict(step, Matrix(root.solve(half)), positions);
}

ForecastCovariance::Vector ForecastCovariance::update(const GivenVector& r, int first, const Given& J,
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

ForecastCovariance::Matrix ForecastCovariance::of_newest(const Given& J) const {
  const Eigen::Index C = chaser_, P = J.rows(), now = chaser_ + before_, M = J.cols();
  Matrix result(C + P, C + P);
  result.topLeftCorner(C, C) = P_.topLeftCorner(C, C);
  result.bottomLeftCorner(P, C) = J.lazyProduct(P_.block(now, 0, M, C));
  result.topRightCorner(C, P) = result.bottomLeftCorner(P, C).transpose();
  const Matrix cross = J.lazyProduct(P_.block(now, now, M, M));
  result.bottomRightCorner(P, P) = cross.lazyProduct(J.transpose());
  return result;
}

}  // namespace tandem::detail
