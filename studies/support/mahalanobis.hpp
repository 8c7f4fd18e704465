#pragma once

#include <optional>

#include <Eigen/Core>

namespace tandem {

/// Returns the squared Mahalanobis distance eᵀ S⁻¹ e. If e is Gaussian with zero mean and covariance S, it is
/// χ²-distributed with as many degrees of freedom as e has rows. Rows of infinite variance do not contribute. Returns
/// NaN if S is not positive semidefinite, or if no row has a finite variance.
double squared_distance(const Eigen::Ref<const Eigen::VectorXd>& error,
                        const Eigen::Ref<const Eigen::MatrixXd>& covariance);

/// Returns squared_distance() of an estimation error (NEES), or nothing where that is NaN.
std::optional<double> normalized_squared_error(const Eigen::Ref<const Eigen::VectorXd>& error,
                                               const Eigen::Ref<const Eigen::MatrixXd>& covariance);

}  // namespace tandem
