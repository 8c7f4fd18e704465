#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include <tandem/problem/program.hpp>

/// For whoever builds a problem: are the derivatives of the whole program right? Within any test framework, e.g.
///
///   EXPECT_LE(check_derivatives(problem, 1).relative, 1e-6);
namespace tandem {

/// The worst entry of a program's derivatives against central differences.
struct DerivativeReport {
  double relative = 0.0;  ///< |analytic − differences| over the largest entry of the row, or of the gradient
  std::string text = "no entry differs";
};

/// Compares the cost's gradient and every row of the constraints' Jacobian at the variables' values ⊕ δ, the entries of
/// δ drawn with standard deviation `size`, extrapolated differences along each unknown. Costs four evaluations an unknown.
inline DerivativeReport check_derivatives(Problem& problem, unsigned seed, double size = 0.1) {
  Program program(problem);
  const int n = program.num_unknowns(), m = program.num_rows();
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, size);
  Eigen::VectorXd delta(n), gradient(n), c(m);
  for (double& d : delta) d = normal(random);
  const auto& pattern = program.jacobian_pattern();
  Eigen::VectorXd values(Eigen::Index(pattern.row.size()));
  program.move_to(delta);
  program.gradient(gradient);
  program.linearize_constraints(c, values);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(m + 1, n);  // the gradient is its last row
  for (std::size_t k = 0; k < pattern.row.size(); ++k) J(pattern.row[k], pattern.column[k]) += values[Eigen::Index(k)];
  J.row(m) = gradient;

  const auto all = [&](int i, double h) {
    Eigen::VectorXd at = delta, f(m + 1), rows(m);
    at[i] += h;
    program.move_to(at);
    program.constraints(rows);
    f << rows, program.cost();
    return f;
  };
  Eigen::MatrixXd differences(m + 1, n);
  for (int i = 0; i < n; ++i) {
    constexpr double h = 1e-3;  // O(h⁴) after one extrapolation
    const Eigen::VectorXd wide = (all(i, h) - all(i, -h)) / (2 * h), narrow = (all(i, h / 2) - all(i, -h / 2)) / h;
    differences.col(i) = (4 * narrow - wide) / 3;
  }
  DerivativeReport report;
  for (int row = 0; row <= m; ++row) {
    const double scale = std::max(J.row(row).cwiseAbs().maxCoeff(), 1e-12);
    Eigen::Index column = 0;
    const double error = (J.row(row) - differences.row(row)).cwiseAbs().maxCoeff(&column) / scale;
    if (error <= report.relative) continue;
    report.relative = std::isfinite(error) ? error : HUGE_VAL;
    report.text = (row < m ? program.describe_row(row) : std::string("the cost's gradient")) + ", by " +
                  program.describe_unknown(int(column)).variable + ": " + std::to_string(J(row, column)) +
                  ", differences " + std::to_string(differences(row, column));
  }
  program.reset();
  return report;
}

}  // namespace tandem
