#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include <tandem/studies/support/mahalanobis.hpp>

namespace tandem {

double squared_distance(const Eigen::Ref<const Eigen::VectorXd>& error,
                        const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  if (covariance.diagonal().array().isFinite().all()) {
    const auto factor = covariance.ldlt();
    const double distance = error.dot(factor.solve(error));
    return factor.isPositive() && distance >= 0 ? distance : NAN;
  }
  std::vector<Eigen::Index> known;
  for (Eigen::Index i = 0; i < error.size(); ++i)
    if (!std::isinf(covariance(i, i))) known.push_back(i);
  if (known.size() == std::size_t(error.size())) return NAN;
  return squared_distance(error(known), covariance(known, known));
}

std::optional<double> normalized_squared_error(const Eigen::Ref<const Eigen::VectorXd>& error,
                                               const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  const double distance = squared_distance(error, covariance);
  return std::isfinite(distance) ? std::optional(distance) : std::nullopt;
}

}  // namespace tandem
