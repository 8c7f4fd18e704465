#include <Eigen/Eigenvalues>

#include <tandem/solvers/calibration/log_factors.hpp>

namespace tandem::detail {

std::vector<Eigen::Index> indices_of(const std::vector<bool>& flags, bool value) {
  std::vector<Eigen::Index> indices;
  for (std::size_t i = 0; i < flags.size(); ++i)
    if (flags[i] == value) indices.push_back(Eigen::Index(i));
  return indices;
}

void update_inverse(Eigen::MatrixXd& inverse, const Eigen::VectorXd& step, const Eigen::VectorXd& change,
                    double min_cosine) {
  const double along = step.dot(change);
  if (!(along > min_cosine * step.norm() * change.norm())) return;
  const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(step.size(), step.size()) - step * change.transpose() / along;
  inverse = A * inverse * A.transpose() + step * step.transpose() / along;
}

std::vector<double> profile_grid(const CalibratedNoise& noise, int points, double low, double high) {
  const double from = std::log(noise.flat_from), to = std::log(noise.flat_to);
  const double middle = 0.5 * (from + to), half = 0.8 * (to - from);
  std::vector<double> grid;
  for (int k = 0; k < points; ++k) {
    const double x = middle + half * (points > 1 ? 2.0 * k / (points - 1) - 1 : 0.0);
    if (x >= low && x <= high) grid.push_back(x);
  }
  return grid;
}

Eigen::MatrixXd regularized_covariance(Eigen::VectorXd prior_sigma, double no_prior, const Eigen::MatrixXd& curvature) {
  for (double& sigma : prior_sigma)
    if (!(sigma > 0)) sigma = no_prior;
  const auto scale = prior_sigma.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale * curvature * scale);
  const Eigen::VectorXd variances = eigen.eigenvalues().cwiseMax(1).cwiseInverse();
  return scale * eigen.eigenvectors() * variances.asDiagonal() * eigen.eigenvectors().transpose() * scale;
}

}  // namespace tandem::detail
