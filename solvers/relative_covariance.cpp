#include <tandem/solvers/relative_covariance.hpp>

namespace tandem::detail {

Eigen::MatrixXd propagated(const Eigen::Ref<const Eigen::MatrixXd>& J, const Eigen::Ref<const Eigen::MatrixXd>& S) {
  return J * S * J.transpose();
}

}  // namespace tandem::detail
