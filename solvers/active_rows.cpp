#include <algorithm>
#include <cmath>

#include <tandem/solvers/active_rows.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>

namespace tandem::detail {
namespace {

/// W over the stiffness of the cost along each row: each solve reduces the error by about this factor. Rounding errors
/// of p grow with it.
constexpr double kWeight = 1e5;
constexpr double kMaxResidual = 1e-12;  // of an equation [standard deviations]
constexpr int kMaxSolves = 20;          // three are usual

}  // namespace

std::vector<ActiveRows::Side> ActiveRows::sides(const NlpEvaluator& nlp, const Eigen::VectorXd& y) {
  std::vector<Side> sides(std::size_t(nlp.num_rows()), inactive);
  for (Eigen::Index i = 0; i < nlp.num_rows(); ++i) {
    const double low = nlp.lower()[i], high = nlp.upper()[i];
    if (low == high || (y[i] > 0 && std::isfinite(high))) sides[std::size_t(i)] = upper;
    if (low != high && y[i] < 0 && std::isfinite(low)) sides[std::size_t(i)] = lower;
  }
  return sides;
}

ActiveRows::ActiveRows(const NlpEvaluator& nlp, const Eigen::VectorXd& jacobian, const std::vector<Side>& sides,
                       const Eigen::VectorXd& scale) {
  const TripletPattern& pattern = nlp.jacobian_pattern();
  const double least = min_curvature(scale);
  root_.setZero(nlp.num_rows());
  for (std::size_t k = 0; k < pattern.row.size(); ++k) {
    const double J = jacobian[Eigen::Index(k)];
    root_[pattern.row[k]] += J * J / std::max(scale[pattern.column[k]], least);
    if (sides[std::size_t(pattern.row[k])] == inactive || J == 0) continue;
    row_.push_back(pattern.row[k]);
    column_.push_back(pattern.column[k]);
    value_.push_back(J);
  }
  weight_.setZero(nlp.num_rows());
  for (Eigen::Index i = 0; i < root_.size(); ++i) {
    root_[i] = root_[i] > 0 ? 1 / std::sqrt(root_[i]) : 1;
    if (sides[std::size_t(i)] != inactive) weight_[i] = kWeight * root_[i] * root_[i];
  }
}

bool ActiveRows::solve(const BlockCholesky& factor, const Eigen::VectorXd& g, const Eigen::VectorXd& b,
                       Eigen::VectorXd& p, Eigen::VectorXd& y) const {
  for (int i = 0; i < kMaxSolves; ++i) {
    residual_ = weight_.cwiseProduct(b) - y;
    p = -g;
    for (std::size_t k = 0; k < value_.size(); ++k) p[column_[k]] += value_[k] * residual_[row_[k]];
    factor.solve(p);
    residual_.setZero();
    for (std::size_t k = 0; k < value_.size(); ++k) residual_[row_[k]] += value_[k] * p[column_[k]];
    double largest = 0;
    for (Eigen::Index row = 0; row < y.size(); ++row) {
      if (weight_[row] == 0) continue;
      const double error = residual_[row] - b[row];
      y[row] += weight_[row] * error;
      largest = std::max(largest, root_[row] * std::abs(error));
    }
    if (!std::isfinite(largest)) return false;
    if (largest <= kMaxResidual * std::max(1.0, root_.cwiseProduct(b).cwiseAbs().maxCoeff())) return true;
  }
  return false;
}

BlockCholesky::Columns ActiveRows::white_product(const BlockCholesky::Columns& X) const {
  BlockCholesky::Columns product = BlockCholesky::Columns::Zero(weight_.size(), X.cols());
  for (std::size_t k = 0; k < value_.size(); ++k)
    product.row(row_[k]) += std::sqrt(weight_[row_[k]]) * value_[k] * X.row(column_[k]);
  return product;
}

}  // namespace tandem::detail
