#include "first_order_conditions.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/QR>

#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

bool is_hard(const Problem& problem, const Block& block) try {
  problem.noise(block);
  return false;
} catch (const Error&) {
  return true;
}

/// Linearised problem.
struct Dense {
  VectorXd gradient, deviation;  // standard deviation of each unknown by the diagonal of the Hessian
  VectorXd c, lower, upper;
  MatrixXd J;
};

Dense linearize(Problem& problem, double least_curvature) {
  std::vector<int> offset(std::size_t(problem.id_bound()), -1);
  int n = 0;
  const auto offset_of = [&](int id, int dof) {
    int& at = offset[std::size_t(id)];
    if (at < 0) at = std::exchange(n, n + dof);
    return at;
  };
  const auto blocks = problem.blocks();
  for (const Block& block : blocks) {
    const auto l = problem.linearization(block);
    for (std::size_t k = 0; k < l.variable_ids.size(); ++k)
      if (!problem.is_fixed(l.variable_ids[k])) offset_of(l.variable_ids[k], l.dofs[k]);
  }
  Dense d;
  d.gradient.setZero(n);
  VectorXd curvature = VectorXd::Zero(n);
  const NlpEvaluator bounds(problem);
  d.lower = bounds.lower();
  d.upper = bounds.upper();
  d.c.setZero(d.lower.size());
  d.J.setZero(d.lower.size(), n);
  Eigen::Index row = 0;
  for (const Block& block : blocks) {
    const auto l = problem.linearization(block);
    MatrixXd J = MatrixXd::Zero(l.residual.size(), n);
    for (std::size_t k = 0, from = 0; k < l.variable_ids.size(); from += std::size_t(l.dofs[k++]))
      if (!problem.is_fixed(l.variable_ids[k]))
        J.middleCols(offset_of(l.variable_ids[k], l.dofs[k]), l.dofs[k]) +=
            l.jacobian.middleCols(Eigen::Index(from), l.dofs[k]);
    if (is_hard(problem, block)) {
      d.c.segment(row, l.residual.size()) = l.residual;
      d.J.middleRows(row, l.residual.size()) = J;
      row += l.residual.size();
    } else {
      const MatrixXd W = problem.noise(block).sqrt_information();
      d.gradient += (W * J).transpose() * (W * l.residual);
      curvature += (W * J).colwise().squaredNorm().transpose();
    }
  }
  const double least = curvature.maxCoeff() > 0 ? least_curvature * curvature.maxCoeff() : 1.0;
  // An unknown that only constraints read has no standard deviation; use the standard deviation of the softest other
  // one.
  double softest = std::max(least, curvature.maxCoeff());
  for (const double h : curvature)
    if (h > 0) softest = std::min(softest, std::max(h, least));
  d.deviation = (curvature.array() > 0).select(curvature.cwiseMax(least), softest).cwiseSqrt().cwiseInverse();
  return d;
}

/// Minimises ‖A y − b‖ over y ≥ 0 by the active-set method of Lawson & Hanson 1974, §23.3.
VectorXd nonnegative_least_squares(const MatrixXd& A, const VectorXd& b) {
  VectorXd y = VectorXd::Zero(A.cols());
  std::vector<Eigen::Index> passive;
  for (Eigen::Index step = 0; step < 10 * A.cols(); ++step) {
    const VectorXd slope = A.transpose() * (b - A * y);
    Eigen::Index best = -1;
    for (Eigen::Index k = 0; k < A.cols(); ++k)
      if (std::find(passive.begin(), passive.end(), k) == passive.end() && (best < 0 || slope[k] > slope[best]))
        best = k;
    if (best < 0 || slope[best] <= 1e-13 * (1 + b.norm())) break;
    passive.push_back(best);
    while (!passive.empty()) {
      MatrixXd P(A.rows(), Eigen::Index(passive.size()));
      for (std::size_t k = 0; k < passive.size(); ++k) P.col(Eigen::Index(k)) = A.col(passive[k]);
      const VectorXd z = P.completeOrthogonalDecomposition().solve(b);
      double fraction = 1;
      for (std::size_t k = 0; k < passive.size(); ++k)
        if (const double now = y[passive[k]], then = z[Eigen::Index(k)]; then <= 0)
          fraction = std::min(fraction, now / std::max(now - then, 1e-300));
      for (std::size_t k = 0; k < passive.size(); ++k) y[passive[k]] += fraction * (z[Eigen::Index(k)] - y[passive[k]]);
      if (fraction >= 1) break;
      std::erase_if(passive, [&](Eigen::Index k) {
        if (y[k] > 1e-15) return false;
        y[k] = 0;
        return true;
      });
    }
  }
  return y;
}

}  // namespace

FirstOrderConditions::FirstOrderConditions(Problem& problem, double least_curvature) {
  constexpr double kAtBound = 1e-4;
  const Dense d = linearize(problem, least_curvature);
  const Eigen::Index n = d.gradient.size();
  const MatrixXd scaled = d.J * d.deviation.asDiagonal();
  // One column of norm 1 per equality (E), per active bound (A), and per active side of a row (sides).
  MatrixXd E(n, 0), A(n, 0), sides(n, 0);
  const auto append = [](MatrixXd& columns, const VectorXd& column) {
    columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
    columns.rightCols<1>() = column;
  };
  Eigen::Index worst = -1;
  double worst_norm = 0;
  std::vector<double> norms_of_E, norms_of_A;
  violation = 0;
  for (Eigen::Index i = 0; i < d.c.size(); ++i)
    for (const double side : {1.0, -1.0}) {
      const double norm = std::max(scaled.row(i).norm(), 1e-300);
      const VectorXd column = side * scaled.row(i).transpose() / norm;
      const double outside = side > 0 ? d.c[i] - d.upper[i] : d.lower[i] - d.c[i];
      if (-outside > kAtBound * norm) continue;
      append(sides, column);
      if (outside > violation) {
        violation = outside;
        worst = sides.cols() - 1;
        worst_norm = norm;
      }
      const bool equality = d.lower[i] == d.upper[i];
      if (equality && side < 0) continue;
      append(equality ? E : A, column);
      (equality ? norms_of_E : norms_of_A).push_back(norm);
    }

  // Eliminates the multipliers of equalities, which may be redundant.
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> equalities(n, E.cols());
  equalities.setThreshold(1e-9);
  if (E.cols() > 0) equalities.compute(E);
  const auto multipliers_of_E = [&](const VectorXd& b) -> VectorXd {
    return E.cols() > 0 ? VectorXd(equalities.solve(b)) : VectorXd();
  };
  const auto without_E = [&](const VectorXd& b) -> VectorXd { return b - E * multipliers_of_E(b); };
  MatrixXd A_left = A;
  for (Eigen::Index k = 0; k < A.cols(); ++k) A_left.col(k) = without_E(A.col(k));

  const VectorXd g = d.gradient.cwiseProduct(d.deviation);
  const VectorXd y_A = nonnegative_least_squares(A_left, without_E(-g)), y_E = multipliers_of_E(-g - A * y_A);
  const VectorXd terms = g.cwiseAbs() + A.cwiseAbs() * y_A + E.cwiseAbs() * y_E.cwiseAbs();
  stationarity = n == 0 ? 0.0 : ((g + A * y_A + E * y_E).cwiseAbs().array() / (1.0 + terms.array())).maxCoeff();
  multipliers = 0;
  for (Eigen::Index k = 0; k < A.cols(); ++k) multipliers += y_A[k] / norms_of_A[std::size_t(k)];
  for (Eigen::Index k = 0; k < E.cols(); ++k) multipliers += std::abs(y_E[k]) / norms_of_E[std::size_t(k)];

  infeasibility = 0;
  if (worst < 0) return;
  const VectorXd gradient = sides.col(worst);
  infeasibility = std::min(worst_norm / violation,  // the gradient of the row may vanish
                           (gradient + sides * nonnegative_least_squares(sides, -gradient)).norm());
}

}  // namespace tandem::testing
