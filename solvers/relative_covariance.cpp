#include <cmath>

#include <tandem/solvers/relative_covariance.hpp>

namespace tandem::detail {
namespace {

constexpr double kRoundingOfJacobian = 1e-12;  // rounding error of an entry of J, relative to its row

}  // namespace

Eigen::MatrixXd propagated(const Eigen::Ref<const Eigen::MatrixXd>& J, const Eigen::Ref<const Eigen::MatrixXd>& S) {
  const Eigen::VectorXd infinite = S.diagonal().unaryExpr([](double s) { return std::isinf(s) ? 1.0 : 0.0; });
  if (infinite.isZero(0)) return J * S * J.transpose();
  const Eigen::VectorXd finite = Eigen::VectorXd::Ones(S.rows()) - infinite;
  const Eigen::MatrixXd bounded =
      S.unaryExpr([](double s) { return std::isinf(s) ? 0.0 : s; }).cwiseProduct(finite * finite.transpose());
  Eigen::MatrixXd result = J * bounded * J.transpose();
  for (Eigen::Index i = 0; i < J.rows(); ++i) {
    if (J.row(i).cwiseAbs().dot(infinite) <= kRoundingOfJacobian * J.row(i).lpNorm<1>()) continue;
    result.row(i).setZero();
    result.col(i).setZero();
    result(i, i) = HUGE_VAL;
  }
  return result;
}

}  // namespace tandem::detail
