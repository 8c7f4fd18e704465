#pragma once

#include <initializer_list>

#include <Eigen/Core>

namespace tandem {

/// Zero-mean Gaussian noise of a residual, stored as a square root W of the information: Wᵀ W = Σ⁻¹, and W r is white.
/// The constructors and factory functions throw Error if a matrix is not symmetric positive definite or a standard
/// deviation is not positive and finite.
class Gaussian {
 public:
  /// Constructs independent noise with these standard deviations, in the units of the residual.
  explicit Gaussian(const Eigen::VectorXd& sigmas);
  Gaussian(std::initializer_list<double> sigmas);
  static Gaussian covariance(const Eigen::MatrixXd& sigma);
  static Gaussian information(const Eigen::MatrixXd& lambda);
  /// Constructs the noise from W, any square root of the information. Throws Error if W is not square, finite and
  /// invertible.
  static Gaussian square_root(const Eigen::MatrixXd& W);

  /// Returns the noise with all standard deviations multiplied by k, e.g. √Δt of a random walk.
  Gaussian scaled(double k) const;
  /// Returns the noise with the standard deviation of each row multiplied by its k: covariance diag(k) Σ diag(k).
  Gaussian scaled(const Eigen::VectorXd& k) const;
  /// Returns log det W, the noise's contribution to the log-density.
  double log_determinant() const;

  Eigen::Index dim() const { return diagonal_.size(); }
  bool is_diagonal() const { return full_.size() == 0; }
  /// Returns 1/σ of each row; valid only if is_diagonal().
  const Eigen::VectorXd& diagonal() const { return diagonal_; }
  /// Returns W as a full matrix.
  Eigen::MatrixXd sqrt_information() const;
  /// Returns Σ.
  Eigen::MatrixXd covariance_matrix() const;

 private:
  Gaussian() = default;

  Eigen::VectorXd diagonal_;
  Eigen::MatrixXd full_;  // empty if diagonal
};

}  // namespace tandem
