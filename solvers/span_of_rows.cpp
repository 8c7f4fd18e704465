#include <utility>

#include <Eigen/QR>

#include <tandem/solvers/span_of_rows.hpp>

namespace tandem::detail {
namespace {

// Multiplier of a unit row, relative to the gradient, above which active rows count as dependent, and the distance of a
// dependent unit row from the others.
constexpr double kMaxMultiplier = 1e4, kDependent = 1e-5;

/// Removes the unit columns after the first `kept` ones that nearly are combinations of columns before them.
void drop_dependent_columns(Eigen::MatrixXd& columns, Eigen::Index kept) {
  Eigen::MatrixXd basis(columns.rows(), 0);
  Eigen::Index left = 0;
  for (Eigen::Index k = 0; k < columns.cols(); ++k) {
    Eigen::VectorXd v = columns.col(k);
    for (int pass = 0; pass < 2; ++pass) v -= basis * (basis.transpose() * v);
    const bool dependent = v.norm() <= kDependent;
    if (k >= kept && dependent) continue;
    columns.col(left++) = columns.col(k);
    if (dependent) continue;
    basis.conservativeResize(Eigen::NoChange, basis.cols() + 1);
    basis.rightCols<1>() = v.normalized();
  }
  columns.conservativeResize(Eigen::NoChange, left);
}

}  // namespace

Eigen::VectorXd outside_span(Eigen::MatrixXd rows, Eigen::Index equalities, const Eigen::VectorXd& gradient) {
  if (rows.cols() == 0) return gradient;
  const Eigen::VectorXd multipliers = rows.colPivHouseholderQr().solve(gradient);
  if (multipliers.cwiseAbs().maxCoeff() <= kMaxMultiplier * gradient.norm()) return gradient - rows * multipliers;
  drop_dependent_columns(rows, equalities);
  return gradient - rows * rows.colPivHouseholderQr().solve(gradient);
}

}  // namespace tandem::detail
