#include <cmath>

#include <gtest/gtest.h>

#include <tandem/solvers/calibration/log_constants.hpp>
#include <tandem/solvers/calibration/tail_term.hpp>

namespace tandem::testing {
namespace {

using detail::tail_term;

Eigen::MatrixXd covariance(double share, const Loss& loss, const Eigen::VectorXd& r) {
  const Eigen::Index n = r.size();
  Eigen::MatrixXd V = Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index i = 1; i < n; ++i) {
    V(i, i) = 1.0 / double(i + 1);
    V(i, i - 1) = V(i - 1, i) = 0.4 / double(i + 1);
  }
  return share / (expected_curvature(loss) * loss(r.squaredNorm()).d1) * V / V.norm();
}

/// Compares with a numerical integral over e, for one row.
TEST(TailTerm, IsTheLogOfTheExpectedRatio) {
  for (const double dof : {0.7, 4.0, 30.0})
    for (const double residual : {0.0, 0.8, -3.0, 25.0})
      for (const double share : {0.02, 0.3, 0.6}) {
        const Loss loss = StudentT(dof, 1);
        const Eigen::VectorXd r = Eigen::VectorXd::Constant(1, residual);
        const double s = residual * residual, u = loss(s).d1, kappa = u * expected_curvature(loss);
        const double V = share / kappa;
        double sum = 0;
        const double step = 0.01 * std::sqrt(V);
        for (int i = -4000; i <= 4000; ++i) {
          const double by = i * step, e = residual + by;
          const double gaussian = -0.5 * loss(s).rho - u * residual * by - 0.5 * kappa * by * by;
          sum += step * std::exp(-0.5 * by * by / V - 0.5 * loss(e * e).rho - gaussian);
        }
        const double expected = std::log(sum / std::sqrt(2 * M_PI * V));
        const double value = tail_term(loss, r, Eigen::MatrixXd::Constant(1, 1, V)).value;
        EXPECT_NEAR(value, expected, 1e-9 * (1 + std::abs(expected))) << dof << " " << residual << " " << share;
      }
}

TEST(TailTerm, VanishesForKnownStatesAndForNormalNoise) {
  const Eigen::VectorXd r = Eigen::Vector3d(1, -2, 0.5);
  EXPECT_NEAR(tail_term(StudentT(4, 3), r, Eigen::MatrixXd::Zero(3, 3)).value, 0, 1e-12);
  const Loss normal = StudentT(1e7, 3);
  EXPECT_NEAR(tail_term(normal, r, covariance(0.5, normal, r)).value, 0, 1e-5);
}

TEST(TailTerm, HasTheRightDerivatives) {
  constexpr double kStep = 1e-5;
  for (const int n : {1, 3, 6, 7})
    for (const double dof : {1.5, 6.0, 100.0})
      for (const double size : {0.0, 1.0, 40.0}) {
        const Loss loss = StudentT(dof, n);
        Eigen::VectorXd r(n);
        for (int i = 0; i < n; ++i) r[i] = size * (i % 2 == 0 ? 0.7 : -0.4);
        const Eigen::MatrixXd V = covariance(0.5, loss, r);
        const auto term = tail_term(loss, r, V);
        const double scale = V.norm();
        for (int i = 0; i < n; ++i) {
          const double step = kStep * (1 + size);
          const Eigen::VectorXd by = step * Eigen::VectorXd::Unit(n, i);
          const double slope = (tail_term(loss, r + by, V).value - tail_term(loss, r - by, V).value) / (2 * step);
          EXPECT_NEAR(term.by_residual[i], slope, 1e-6 * (1 + std::abs(slope))) << n << " " << dof << " " << size;
          for (int j = 0; j <= i; ++j) {
            Eigen::MatrixXd change = Eigen::MatrixXd::Zero(n, n);
            change(i, j) = change(j, i) = kStep * scale;
            const double rise = tail_term(loss, r, V + change).value - tail_term(loss, r, V - change).value;
            const double expected = rise / (2 * kStep), by_both = (i == j ? 1 : 2) * scale * term.by_covariance(i, j);
            EXPECT_NEAR(by_both, expected, 1e-6 * (1 + std::abs(expected))) << n << " " << dof << " " << size;
          }
        }
      }
}

}  // namespace
}  // namespace tandem::testing
