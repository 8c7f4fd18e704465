#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <tandem/solvers/secant.hpp>

namespace tandem::detail {
namespace {

/// Rounds to the precision of stored pairs.
Eigen::VectorXd rounded(const Eigen::VectorXd& x) { return x.cast<float>().cast<double>(); }

Eigen::VectorXd wave(Eigen::Index n, double frequency) {
  return rounded(
      Eigen::VectorXd::NullaryExpr(n, [=](Eigen::Index i) { return std::sin(1.0 + frequency * double(i)); }));
}

Eigen::MatrixXd positive_definite(Eigen::Index n, double frequency) {
  Eigen::MatrixXd A(n, n);
  for (Eigen::Index j = 0; j < n; ++j) A.col(j) = wave(n, frequency + double(j));
  return A * A.transpose() + Eigen::MatrixXd::Identity(n, n);
}

class SecantTest : public ::testing::Test {
 protected:
  static constexpr Eigen::Index n = 7;
  Eigen::MatrixXd B = positive_definite(n, 0.7), H = B + positive_definite(n, 1.9);
  Eigen::LLT<Eigen::MatrixXd> llt{B};
  TaskRunner tasks;
  ChunkedLoop parts{tasks, n, 2};  // more parts than unknowns

  template <class Scalar>
  Eigen::VectorXd apply(SecantPairs<Scalar>& pairs, Eigen::VectorXd d) const {
    pairs.apply(d, [&](Eigen::VectorXd& v) { v = llt.solve(v); });
    return d;
  }
  /// Change of the gradient along a step, for a quadratic with Hessian H.
  Eigen::VectorXd change(const Eigen::VectorXd& step) const { return rounded(H * step); }
  void add(SecantPairs<float>& pairs, const Eigen::VectorXd& step) const {
    pairs.add(step, Eigen::VectorXd::Zero(n), change(step));
  }
  /// Inverse Hessian by dense BFGS updates of B⁻¹ (Nocedal & Wright 2006, eq. 6.17).
  Eigen::MatrixXd bfgs(const std::vector<Eigen::VectorXd>& steps) const {
    const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(n, n);
    Eigen::MatrixXd inverse = B.inverse();
    for (const auto& s : steps) {
      const Eigen::VectorXd y = change(s);
      const double rho = 1.0 / s.dot(y);
      inverse = (I - rho * s * y.transpose()) * inverse * (I - rho * y * s.transpose()) + rho * s * s.transpose();
    }
    return inverse;
  }
};

TEST_F(SecantTest, WithoutPairsEqualsTheGivenInverse) {
  SecantPairs<float> pairs(parts, n, 3), none(parts, n, 0);
  const Eigen::VectorXd d = wave(n, 2.0);
  EXPECT_EQ(apply(pairs, d), llt.solve(d));
  add(none, wave(n, 1.0));
  EXPECT_EQ(apply(none, d), llt.solve(d));
}

TEST_F(SecantTest, EqualsDenseBfgs) {
  SecantPairs<float> pairs(parts, n, 3);
  std::vector<Eigen::VectorXd> steps;
  for (int k = 0; k < 3; ++k) {
    steps.push_back(wave(n, 0.5 + k));
    add(pairs, steps.back());
    const Eigen::VectorXd d = wave(n, 2.0);
    EXPECT_LE((apply(pairs, d) - bfgs(steps) * d).norm(), 1e-12 * d.norm());
  }
}

TEST_F(SecantTest, KeepsTheLastPairs) {
  SecantPairs<float> pairs(parts, n, 3);
  std::vector<Eigen::VectorXd> steps;
  for (int k = 0; k < 8; ++k) add(pairs, steps.emplace_back(wave(n, 0.5 + k)));
  const Eigen::VectorXd d = wave(n, 2.0);
  EXPECT_LE((apply(pairs, d) - bfgs({steps.end() - 3, steps.end()}) * d).norm(), 1e-12 * d.norm());
}

TEST_F(SecantTest, SatisfiesTheSecantEquation) {
  SecantPairs<float> pairs(parts, n, 3);
  for (int k = 0; k < 5; ++k) {
    const Eigen::VectorXd step = wave(n, 0.5 + k);
    add(pairs, step);
    EXPECT_LE((apply(pairs, change(step)) - step).norm(), 1e-12 * step.norm());
  }
}

TEST_F(SecantTest, DiscardsPairsWithoutPositiveCurvature) {
  SecantPairs<float> pairs(parts, n, 3);
  const Eigen::VectorXd g = wave(n, 3.0), step = wave(n, 1.0), d = wave(n, 2.0);
  pairs.add(step, g, g - step);
  pairs.add(step, g, g);
  pairs.add(step, g, Eigen::VectorXd::Constant(n, std::numeric_limits<double>::quiet_NaN()));
  EXPECT_EQ(apply(pairs, d), llt.solve(d));
  add(pairs, step);
  pairs.add(wave(n, 4.0), g, g - wave(n, 4.0));  // existing pairs are kept
  EXPECT_LE((apply(pairs, d) - bfgs({step}) * d).norm(), 1e-12 * d.norm());
}

/// The exact part of the Hessian may change after the step. Pairs then act as if added with the new one.
TEST_F(SecantTest, UsesThePresentHessianOfTheTerm) {
  const Eigen::MatrixXd term = positive_definite(n, 3.1);
  SecantPairs<double> pairs(parts, n, 3, true), whole(parts, n, 3);
  const Eigen::VectorXd g = wave(n, 3.0), d = wave(n, 2.0);
  for (int k = 0; k < 5; ++k) {
    const Eigen::VectorXd step = wave(n, 0.5 + k);
    pairs.add(step, g, g + (H - 0.5 * term) * step);
    whole.add(step, g, g + (H + term) * step);
  }
  pairs.refresh([&](const auto& s, auto&& y) { y += 1.5 * term * s; });
  const Eigen::VectorXd expected = apply(whole, d);
  EXPECT_LE((apply(pairs, d) - expected).norm(), 1e-12 * expected.norm());
}

TEST_F(SecantTest, DiscardsPairsThatAreNotFiniteWhenFull) {
  SecantPairs<float> pairs(parts, n, 2);
  const Eigen::VectorXd g = wave(n, 3.0), d = wave(n, 2.0);
  for (int k = 0; k < 2; ++k) add(pairs, wave(n, 0.5 + k));
  pairs.add(wave(n, 4.0), g, Eigen::VectorXd::Constant(n, std::numeric_limits<double>::quiet_NaN()));
  EXPECT_LE((apply(pairs, d) - bfgs({wave(n, 1.5)}) * d).norm(), 1e-12 * d.norm());
}

TEST_F(SecantTest, ClearRemovesAllPairs) {
  SecantPairs<float> pairs(parts, n, 3);
  for (int k = 0; k < 5; ++k) add(pairs, wave(n, 0.5 + k));
  pairs.clear();
  const Eigen::VectorXd d = wave(n, 2.0), step = wave(n, 1.1);
  EXPECT_EQ(apply(pairs, d), llt.solve(d));
  add(pairs, step);
  EXPECT_LE((apply(pairs, d) - bfgs({step}) * d).norm(), 1e-12 * d.norm());
}

}  // namespace
}  // namespace tandem::detail
