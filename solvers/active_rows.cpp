#include <algorithm>
#include <cmath>

#include <tandem/solvers/active_rows.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/linear/jacobian_products.hpp>
#include <tandem/solvers/linear/panel_kernels.hpp>

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

void ActiveRows::drop_inactive(NlpEvaluator& nlp, Eigen::VectorXd& y) {
  if (y.size() == 0) return;
  Eigen::VectorXd gradient(nlp.num_unknowns()), scale(nlp.num_unknowns()), c(y.size());
  Eigen::VectorXd hessian(nlp.hessian_pattern().nonzeros()), jacobian(Eigen::Index(nlp.jacobian_pattern().row.size()));
  nlp.linearize(gradient, hessian);
  hessian_diagonal(nlp.hessian_pattern(), hessian, scale);
  nlp.linearize_constraints(c, jacobian);
  ActiveRows rows;
  rows.set(nlp, jacobian, sides(nlp, y), scale);
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    const double low = nlp.lower()[i], high = nlp.upper()[i];
    const double slack = y[i] > 0 ? high - c[i] : c[i] - low, root = rows.root_stiffness(i);
    if (low != high && std::abs(y[i]) <= slack * root * root) y[i] = 0;
  }
}

void ActiveRows::set(const NlpEvaluator& nlp, const Eigen::VectorXd& jacobian, const std::vector<Side>& sides,
                     const Eigen::VectorXd& scale) {
  const TripletPattern& pattern = nlp.jacobian_pattern();
  Eigen::VectorXd& variance = change_;
  variance = scale.cwiseMax(min_curvature(scale)).cwiseInverse();
  root_.setZero(nlp.num_rows());
  for (std::vector<int>* places : {&entries_.row, &entries_.column}) {
    places->clear();
    places->reserve(pattern.row.size());
  }
  value_.resize(jacobian.size());
  for (std::size_t k = 0; k < pattern.row.size(); ++k) {
    const double J = jacobian[Eigen::Index(k)];
    root_[pattern.row[k]] += J * J * variance[pattern.column[k]];
    if (sides[std::size_t(pattern.row[k])] == inactive || J == 0) continue;
    value_[Eigen::Index(entries_.row.size())] = J;
    entries_.row.push_back(pattern.row[k]);
    entries_.column.push_back(pattern.column[k]);
  }
  weight_.setZero(nlp.num_rows());
  for (Eigen::Index i = 0; i < root_.size(); ++i) {
    root_[i] = root_[i] > 0 ? 1 / std::sqrt(root_[i]) : 1;
    if (sides[std::size_t(i)] != inactive) weight_[i] = kWeight * root_[i] * root_[i];
  }
}

double ActiveRows::size(const Eigen::VectorXd& errors, const Eigen::VectorXd& b) const {
  return root_.cwiseProduct(errors).cwiseAbs().maxCoeff() / std::max(1.0, root_.cwiseProduct(b).cwiseAbs().maxCoeff());
}

double ActiveRows::solve(const BlockCholesky& factor, const Eigen::VectorXd& g, const Eigen::VectorXd& b,
                         Eigen::VectorXd& p, Eigen::VectorXd& y, Eigen::VectorXd& errors) const {
  rhs_ = weight_.cwiseProduct(b) - y;
  p = -g;
  add_transposed_product(entries_, value_, rhs_, p);
  factor.solve(p);
  errors = -b;
  add_jacobian_product(entries_, value_, p, errors);
  y += weight_.cwiseProduct(errors);
  return empty() ? 0.0 : size(errors, b);
}

bool ActiveRows::refine(const BlockCholesky& factor, const Eigen::VectorXd& b, Eigen::VectorXd& p, Eigen::VectorXd& y,
                        Eigen::VectorXd& errors) const {
  for (int i = 0; i < kMaxSolves; ++i) {
    const double error = size(errors, b);
    if (!std::isfinite(error)) return false;
    if (error <= kMaxResidual) return true;
    correct(factor, p, y, errors);
  }
  return false;
}

void ActiveRows::correct(const BlockCholesky& factor, Eigen::VectorXd& p, Eigen::VectorXd& y,
                         Eigen::VectorXd& errors) const {
  rhs_ = -weight_.cwiseProduct(errors);
  change_.setZero(p.size());
  add_transposed_product(entries_, value_, rhs_, change_);
  factor.solve(change_);
  p += change_;
  add_jacobian_product(entries_, value_, change_, errors);
  y += weight_.cwiseProduct(errors);
}

BlockCholesky::Columns ActiveRows::white_product(const BlockCholesky::Columns& X) const {
  std::vector<Eigen::Index> place(std::size_t(weight_.size()));  // among the active rows
  Eigen::Index active = 0;
  for (std::size_t row = 0; row < place.size(); ++row) place[row] = weight_[Eigen::Index(row)] > 0 ? active++ : 0;
  BlockCholesky::Columns product(active, X.cols());
  std::fill_n(product.data(), product.size(), 0.0);
  dispatch_simd([&]() TANDEM_INLINED_HERE {
    for (std::size_t k = 0; k < entries_.row.size(); ++k) {
      const int row = entries_.row[k];
      const double factor = -std::sqrt(weight_[row]) * value_[Eigen::Index(k)];
      const double* from = X.data() + entries_.column[k] * X.cols();
      double* to = product.data() + place[std::size_t(row)] * X.cols();
      for (Eigen::Index j = 0; j < X.cols(); j += 8) subtract_eight(factor, from + j, to + j);
    }
  });
  return product;
}

}  // namespace tandem::detail
