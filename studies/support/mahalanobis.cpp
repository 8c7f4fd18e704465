#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include <tandem/studies/support/mahalanobis.hpp>

namespace tandem {

double squared_distance(const Eigen::Ref<const Eigen::VectorXd>& error,
                        const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  if (covariance.diagonal().array().isFinite().all()) return error.dot(covariance.ldlt().solve(error));
  std::vector<Eigen::Index> known;
  for (Eigen::Index i = 0; i < error.size(); ++i)
    if (!std::isinf(covariance(i, i))) known.push_back(i);
  if (known.size() == std::size_t(error.size())) return NAN;
  return squared_distance(error(known), covariance(known, known));
}

}  // namespace tandem
