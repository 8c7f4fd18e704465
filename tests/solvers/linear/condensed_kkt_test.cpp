#include <optional>
#include <random>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/linear/condensed_kkt.hpp>

namespace tandem::testing {
namespace {

using Matrix = Eigen::MatrixXd;
using Eigen::VectorXd;

/// Chain of points with equalities and inequalities between neighbours, and its KKT matrix in the form of an
/// interior-point method. Rows of equalities and inequalities are mixed.
class CondensedKktTest : public ::testing::Test {
 protected:
  CondensedKktTest() {
    for (int k = 0; k < 6; ++k) x.push_back(problem.add(R3()));
    for (int k = 0; k < 6; ++k) problem.minimize(Prior<R3>{R3()}, Gaussian{1.0, 2.0, 0.5}, {x[std::size_t(k)]});
    for (std::size_t k = 0; k + 1 < x.size(); ++k) {
      problem.minimize(RelativePose<R3>{R3()}, Gaussian{0.3, 0.1, 1.0}, {x[k], x[k + 1]});
      Bounds<3> bounds{Vector<3>(0, -1, 0), Vector<3>(0, 1, 5)};
      if (k % 2 == 0) problem.subject_to(RelativePose<R3>{R3()}, bounds, {x[k], x[k + 1]});
    }
    nlp.emplace(problem);
    n = nlp->num_unknowns();
    for (int i = 0; i < nlp->num_rows(); ++i)
      (nlp->lower()[i] == nlp->upper()[i] ? equalities : inequalities).push_back(i);
    p = int(equalities.size()), q = int(inequalities.size());
    H = Matrix::Zero(n, n);
    VectorXd gradient(n), values(nlp->hessian_pattern().nonzeros());
    nlp->linearize(gradient, values);
    const SymmetricPattern& pattern = nlp->hessian_pattern();
    const std::vector<int> start = pattern.column_starts(), row = pattern.rows();
    for (int c = 0; c < n; ++c)
      for (int k = start[std::size_t(c)]; k < start[std::size_t(c) + 1]; ++k)
        H(row[std::size_t(k)], c) = H(c, row[std::size_t(k)]) = values[k];
    // // a random Jacobian with the pattern of the problem
    J = Matrix::Zero(nlp->num_rows(), n);
    for (std::size_t k = 0; k < nlp->jacobian_pattern().row.size(); ++k)
      J(nlp->jacobian_pattern().row[k], nlp->jacobian_pattern().column[k]) = normal(random);
    S = VectorXd::NullaryExpr(q, [&] { return std::exp(4 * normal(random)); });
    C = VectorXd::Zero(p);
    D = VectorXd::Zero(q);
  }

  void entry(int i, int j, double value) {
    rows.push_back(i + 1);
    columns.push_back(j + 1);
    values.push_back(value);
  }
  /// Assembles the triplets, and returns the dense matrix.
  Matrix assemble(double coupling = -1.0) {
    rows.clear(), columns.clear(), values.clear();
    const SymmetricPattern& pattern = nlp->hessian_pattern();
    const std::vector<int> start = pattern.column_starts(), row = pattern.rows();
    for (int c = 0; c < n; ++c)
      for (int k = start[std::size_t(c)]; k < start[std::size_t(c) + 1]; ++k)
        if (const int r = row[std::size_t(k)]; r >= c) entry(r, c, H(r, c) - (r == c ? 0.25 : 0.0));
    for (int i = 0; i < n; ++i) entry(i, i, 0.25);  // Σ as separate entries
    for (int k = 0; k < q; ++k) entry(n + k, n + k, S[k]);
    for (const bool equality : {true, false}) {
      const auto& list = equality ? equalities : inequalities;
      const int first = n + q + (equality ? 0 : p);
      for (std::size_t k = 0; k < nlp->jacobian_pattern().row.size(); ++k) {
        const int row = nlp->jacobian_pattern().row[k], column = nlp->jacobian_pattern().column[k];
        const auto at = std::find(list.begin(), list.end(), row);
        if (at != list.end()) entry(first + int(at - list.begin()), column, J(row, column));
      }
      for (int k = 0; k < int(list.size()); ++k) entry(first + k, first + k, -(equality ? C : D)[k]);
    }
    for (int k = 0; k < q; ++k) entry(n + q + p + k, n + k, coupling);
    Matrix K = Matrix::Zero(n + p + 2 * q, n + p + 2 * q);
    for (std::size_t k = 0; k < values.size(); ++k) {
      K(rows[k] - 1, columns[k] - 1) += values[k];
      if (rows[k] != columns[k]) K(columns[k] - 1, rows[k] - 1) += values[k];
    }
    return K;
  }
  bool analyze(detail::CondensedKkt& kkt) {
    return kkt.analyze(n + p + 2 * q, int(values.size()), rows.data(), columns.data(), 1);
  }
  /// Solves with one step of refinement, as Ipopt does.
  static VectorXd refined(detail::CondensedKkt& kkt, const Matrix& K, const VectorXd& b) {
    VectorXd x = VectorXd::Zero(b.size());
    for (int step = 0; step < 2; ++step) {
      VectorXd residual = b - K * x;
      kkt.solve(residual.data());
      x += residual;
    }
    return x;
  }
  void expect_solved(const Matrix& K, bool pivoted = false) {
    detail::CondensedKkt kkt(*nlp);
    ASSERT_EQ(kkt.size(), K.rows());
    EXPECT_EQ(kkt.num_constraints(), p + q);
    ASSERT_TRUE(analyze(kkt));
    ASSERT_TRUE(kkt.factorize(values.data(), pivoted));
    for (int trial = 0; trial < 3; ++trial) {
      const VectorXd b = VectorXd::NullaryExpr(K.rows(), [&] { return normal(random); });
      const VectorXd expected = K.fullPivLu().solve(b);
      const VectorXd found = refined(kkt, K, b);
      EXPECT_LE((found - expected).norm(), 1e-8 * expected.norm());
    }
  }

  Problem problem;
  std::vector<Variable<R3>> x;
  std::optional<NlpEvaluator> nlp;
  std::vector<int> equalities, inequalities;
  int n = 0, p = 0, q = 0;
  Matrix H, J;
  VectorXd S, C, D;
  std::vector<int> rows, columns;
  std::vector<double> values;
  std::mt19937_64 random{7};
  std::normal_distribution<double> normal;
};

TEST_F(CondensedKktTest, MatchesTheDenseSolution) { expect_solved(assemble()); }

TEST_F(CondensedKktTest, SolvesWithRegularisedConstraintsAndScaledSlacks) {
  C.setConstant(0.3);
  D.setConstant(2.0);
  expect_solved(assemble(-0.2));
}

/// Near a solution, S of active inequalities becomes very large, and S of inactive ones very small.
TEST_F(CondensedKktTest, SolvesWithActiveAndInactiveInequalities) {
  for (int k = 0; k < q; ++k) S[k] = k % 2 == 0 ? 1e9 : 1e-9;
  expect_solved(assemble());
  S.setZero();
  expect_solved(assemble());
}

/// Only constraints determine some of the unknowns. Condensation modifies their rows by too much.
TEST_F(CondensedKktTest, SolvesByPivotsWhereOnlyConstraintsReadAVariable) {
  for (const int k : {0, 4}) {
    H.row(k).setZero();
    H.col(k).setZero();
  }
  expect_solved(assemble(), true);
}

/// The factorisation succeeds if and only if the matrix has one negative eigenvalue per constraint.
TEST_F(CondensedKktTest, DetectsTheInertiaOfTheWholeMatrix) {
  const Matrix definite = H;
  int right = 0, wrong = 0;
  for (double shift = 0; shift < 12; shift += 0.4) {
    H = definite;
    H.diagonal().array() -= shift;
    const Matrix K = assemble();
    const VectorXd eigenvalues = Eigen::SelfAdjointEigenSolver<Matrix>(K, Eigen::EigenvaluesOnly).eigenvalues();
    const bool expected = (eigenvalues.array() < 0).count() == p + q;
    ++(expected ? right : wrong);
    detail::CondensedKkt kkt(*nlp);
    ASSERT_TRUE(analyze(kkt));
    EXPECT_EQ(kkt.factorize(values.data()), expected) << shift;
    if (!expected) {
      VectorXd b = VectorXd::Ones(K.rows());
      kkt.solve(b.data());
      EXPECT_EQ(b, VectorXd::Zero(K.rows()).eval());
    }
  }
  EXPECT_GT(right, 3);
  EXPECT_GT(wrong, 3);
}

/// If the gradient of a constraint vanishes, the matrix is singular, and a consistent system has many solutions.
TEST_F(CondensedKktTest, AllowsARowOfZeros) {
  J.row(equalities[1]).setZero();
  const Matrix K = assemble();
  detail::CondensedKkt kkt(*nlp);
  ASSERT_TRUE(analyze(kkt));
  ASSERT_TRUE(kkt.factorize(values.data()));
  VectorXd b = VectorXd::Ones(K.rows());
  b[n + q + 1] = 0;  // 0 = 0
  EXPECT_LE((K * refined(kkt, K, b) - b).norm(), 1e-8);
}

TEST_F(CondensedKktTest, RejectsAMatrixOfAnotherForm) {
  detail::CondensedKkt kkt(*nlp);
  assemble();
  EXPECT_TRUE(analyze(kkt));
  EXPECT_FALSE(kkt.analyze(n + p + 2 * q - 1, int(values.size()), rows.data(), columns.data(), 1));
  entry(n - 1, 0, 1.0);  // no block of the problem reads both
  EXPECT_FALSE(analyze(kkt));
  assemble();
  entry(n + q, 0, 1.0);  // additional entry in the Jacobian
  EXPECT_FALSE(analyze(kkt));
  assemble();
  rows.back() = n + q + 1;  // a slack in an equality
  EXPECT_FALSE(analyze(kkt));
}

}  // namespace
}  // namespace tandem::testing
