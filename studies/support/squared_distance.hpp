#pragma once

#include <Eigen/Core>

namespace tandem {

/// eᵀ S⁻¹ e, Mahalanobis: of an error with covariance S it is χ²-distributed, with as many degrees of freedom as rows.
double squared_distance(const Eigen::Ref<const Eigen::VectorXd>& error,
                        const Eigen::Ref<const Eigen::MatrixXd>& covariance);

}  // namespace tandem
