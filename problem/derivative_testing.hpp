#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include <tandem/problem/nlp_evaluator.hpp>

namespace tandem {

/// Result of check_derivatives(): the derivative that differs most from finite differences.
struct DerivativeReport {
  double relative = 0.0;  ///< |analytic − numeric| over the largest entry of the row or gradient
  std::string text = "all derivatives agree";
};

/// Checks the derivatives of a whole problem in a unit test, with any test framework:
///
///   EXPECT_LE(check_derivatives(problem, 1).relative, 1e-6);
///
/// Compares the gradient of the cost and all rows of the constraint Jacobian with central differences, extrapolated to
/// O(h⁴). The point is X̄ ⊕ δ, where X̄ are the current values and the entries of δ are normal with standard deviation
/// `size` [m, rad]. Takes four evaluations per unknown.
inline DerivativeReport check_derivatives(Problem& problem, unsigned seed, double size = 0.1) {
  NlpEvaluator nlp(problem);
  const int n = nlp.num_unknowns(), m = nlp.num_rows();
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, size);
  Eigen::VectorXd delta(n), gradient(n), c(m);
  for (double& d : delta) d = normal(random);
  const auto& pattern = nlp.jacobian_pattern();
  Eigen::VectorXd values(Eigen::Index(pattern.row.size()));
  nlp.move_to(delta);
  nlp.gradient(gradient);
  nlp.linearize_constraints(c, values);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(m + 1, n);  // the last row is the gradient
  for (std::size_t k = 0; k < pattern.row.size(); ++k) J(pattern.row[k], pattern.column[k]) += values[Eigen::Index(k)];
  J.row(m) = gradient;

  const auto perturbed = [&](int i, double h) {
    Eigen::VectorXd at = delta, f(m + 1), rows(m);
    at[i] += h;
    nlp.move_to(at);
    nlp.constraints(rows);
    f << rows, nlp.cost();
    return f;
  };
  Eigen::MatrixXd differences(m + 1, n);
  for (int i = 0; i < n; ++i) {
    constexpr double h = 1e-3;  // O(h⁴) after one extrapolation
    const Eigen::VectorXd wide = (perturbed(i, h) - perturbed(i, -h)) / (2 * h),
                          narrow = (perturbed(i, h / 2) - perturbed(i, -h / 2)) / h;
    differences.col(i) = (4 * narrow - wide) / 3;
  }
  DerivativeReport report;
  for (int row = 0; row <= m; ++row) {
    const double scale = std::max(J.row(row).cwiseAbs().maxCoeff(), 1e-12);
    Eigen::Index column = 0;
    const double error = (J.row(row) - differences.row(row)).cwiseAbs().maxCoeff(&column) / scale;
    if (error <= report.relative) continue;
    report.relative = std::isfinite(error) ? error : HUGE_VAL;
    report.text = (row < m ? nlp.describe_row(row) : std::string("gradient of the cost")) +
                  ", derivative with respect to " + nlp.describe_unknown(int(column)).variable + ": analytic " +
                  std::to_string(J(row, column)) + ", numeric " + std::to_string(differences(row, column));
  }
  nlp.reset();
  return report;
}

}  // namespace tandem
