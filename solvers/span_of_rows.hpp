#pragma once

#include <Eigen/Core>

namespace tandem::detail {

/// Returns the part of a gradient that no combination of active constraints cancels. The columns of `rows` are their
/// unit gradients, first those of `equalities` equalities. Inequalities that nearly depend on rows before them are left
/// out if the combination needs large multipliers: near a degenerate corner, it would cancel any gradient.
Eigen::VectorXd outside_span(Eigen::MatrixXd rows, Eigen::Index equalities, const Eigen::VectorXd& gradient);

}  // namespace tandem::detail
