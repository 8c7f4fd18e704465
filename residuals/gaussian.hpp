#pragma once

#include <initializer_list>

#include <Eigen/Core>

namespace tandem {

/// Zero-mean Gaussian noise of a residual, kept as a square root W of the information: Wᵀ W = Σ⁻¹, and W r is white.
/// Every maker throws Error when the matrix is not symmetric positive definite or a sigma not positive and finite.
class Gaussian {
 public:
  /// Independent rows with these standard deviations, in the residual's units.
  explicit Gaussian(const Eigen::VectorXd& sigmas);
  Gaussian(std::initializer_list<double> sigmas);
  static Gaussian covariance(const Eigen::MatrixXd& sigma);
  static Gaussian information(const Eigen::MatrixXd& lambda);
  /// By W itself, any square root of the information; throws Error when it is not square, finite and invertible.
  static Gaussian square_root(const Eigen::MatrixXd& W);

  /// The same with every standard deviation times k, e.g. √Δt of a random walk.
  Gaussian scaled(double k) const;
  /// The same with the standard deviation of each row times its k: covariance diag(k) Σ diag(k).
  Gaussian scaled(const Eigen::VectorXd& k) const;
  /// log det W, the noise's part in the logarithm of its density.
  double log_determinant() const;

  Eigen::Index dim() const { return diagonal_.size(); }
  bool is_diagonal() const { return full_.size() == 0; }
  /// 1/σ of each row; meaningful when is_diagonal().
  const Eigen::VectorXd& diagonal() const { return diagonal_; }
  /// W, also when it is diagonal.
  Eigen::MatrixXd sqrt_information() const;
  /// Σ.
  Eigen::MatrixXd covariance_matrix() const;

 private:
  Gaussian() = default;

  Eigen::VectorXd diagonal_;
  Eigen::MatrixXd full_;  // empty when diagonal
};

}  // namespace tandem
