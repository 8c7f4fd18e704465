#include <Eigen/Cholesky>

#include <tandem/studies/support/mahalanobis.hpp>

namespace tandem {

double squared_distance(const Eigen::Ref<const Eigen::VectorXd>& error,
                        const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  return error.dot(covariance.ldlt().solve(error));
}

}  // namespace tandem
