#include <atomic>
#include <thread>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <tandem/problem/parallel_tasks.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/linear/block_symbolic.hpp>

#include "allocations.hpp"
#include "block_matrix.hpp"

namespace tandem::testing {
namespace {

std::vector<BlockMatrix> matrices() {
  std::vector<BlockMatrix> all{make_matrix({1}, {}, 1),       make_matrix({6}, {}, 2), make_matrix({3, 3}, {{0, 1}}, 3),
                               make_matrix({6, 3, 2}, {}, 4), chain(40, 1, 5),         chain(40, 4, 6),
                               long_chain(1, false, 7),       long_chain(3, true, 8)};
  for (unsigned seed = 10; seed < 30; ++seed) all.push_back(star(12, int(seed), seed));
  return all;
}

/// Returns an estimate of the condition number of A = L Lᵀ from below, by power iterations.
double condition(const Eigen::MatrixXd& A, const Eigen::LLT<Eigen::MatrixXd>& llt) {
  Eigen::VectorXd largest = right_side(A.rows()), smallest = largest;
  for (int i = 0; i < 20; ++i) {
    largest = (A * largest).normalized();
    smallest = llt.solve(smallest).normalized();
  }
  return largest.dot(A * largest) / smallest.dot(A * smallest);
}

TEST(BlockCholesky, MatchesDenseLlt) {
  for (const BlockMatrix& m : matrices()) {
    BlockCholesky cholesky(m.pattern);
    ASSERT_TRUE(cholesky.factorize(m.values));
    Eigen::VectorXd x = right_side(m.dense.rows());
    const Eigen::LLT<Eigen::MatrixXd> llt(m.dense);
    const Eigen::VectorXd expected = llt.solve(x);
    cholesky.solve(x);
    EXPECT_LE((x - expected).norm(), 1e-14 * condition(m.dense, llt) * expected.norm());
  }
}

TEST(BlockCholesky, ChainsKeepTheirOrderAndStarsDoNot) {
  const BlockMatrix band = chain(30, 2, 1), wheel = star(30, 0, 2);
  const detail::BlockSymbolic a = detail::analyze(band.pattern, BlockCholesky::kDefaultNaturalFlops, true),
                              b = detail::analyze(wheel.pattern, BlockCholesky::kDefaultNaturalFlops, true);
  EXPECT_TRUE(std::is_sorted(a.order.begin(), a.order.end()));
  EXPECT_EQ(a.row.size(), band.pattern.block_row.size()) << "no fill";
  EXPECT_FALSE(std::is_sorted(b.order.begin(), b.order.end()));
  EXPECT_EQ(b.row.size(), wheel.pattern.block_row.size()) << "no fill with the hub last";
  std::vector<int> sorted = b.order;
  std::sort(sorted.begin(), sorted.end());
  for (int i = 0; i < 30; ++i) EXPECT_EQ(sorted[std::size_t(i)], i);
}

TEST(BlockCholesky, LongChainsAreEliminatedFromBothEnds) {
  for (const bool hub : {false, true}) {
    const SymmetricPattern pattern = long_chain(2, hub, 1).pattern;
    const int n = pattern.num_blocks(), half = n / 2, separator = hub ? 3 : 2;
    const detail::BlockSymbolic s = detail::analyze(pattern, BlockCholesky::kDefaultNaturalFlops, true);
    ASSERT_EQ(s.first_part, half);
    ASSERT_EQ(s.second_part, n - separator);
    std::vector<int> expected;
    for (int b = 0; b < half; ++b) expected.push_back(b);
    for (int b = n - 1 - hub; b > half + 1; --b) expected.push_back(b);
    expected.insert(expected.end(), {half, half + 1});
    if (hub) expected.push_back(n - 1);
    EXPECT_EQ(s.order, expected);
    EXPECT_LE(s.row.size(), pattern.block_row.size() + 2) << "fill only at the separator";
    for (int k = 0; k < s.second_part; ++k)
      for (int b = s.row_start[std::size_t(k)]; b < s.row_start[std::size_t(k) + 1]; ++b) {
        const int row = s.row[std::size_t(b)];
        EXPECT_TRUE(row >= s.second_part || (row < s.first_part) == (k < s.first_part)) << k;
      }
    const detail::BlockSymbolic in_order = detail::analyze(pattern, BlockCholesky::kDefaultNaturalFlops, false);
    EXPECT_EQ(in_order.second_part, 0);
    EXPECT_TRUE(std::is_sorted(in_order.order.begin(), in_order.order.end()));
  }
}

TEST(BlockCholesky, ResultsDoNotDependOnThreads) {
  const BlockMatrix m = long_chain(12, true, 3);
  BlockCholesky alone(m.pattern), shared(m.pattern);
  ASSERT_GT(alone.nonzeros(), detail::kMinEntriesForThreads);
  detail::TaskRunner tasks;
  tasks.use_threads(2);
  shared.use(tasks);
  const Eigen::VectorXd b = right_side(m.dense.rows()), shift = b.cwiseAbs();
  for (const bool shifted : {false, true}) {
    ASSERT_TRUE(alone.factorize(m.values, shifted ? shift : Eigen::VectorXd()));
    ASSERT_TRUE(shared.factorize(m.values, shifted ? shift : Eigen::VectorXd()));
    Eigen::VectorXd x = b, y = b;
    alone.solve(x);
    shared.solve(y);
    EXPECT_EQ(x, y);
    EXPECT_EQ(alone.inverse_of({3, 200}), shared.inverse_of({3, 200}));
  }
  Eigen::VectorXd fails = Eigen::VectorXd::Zero(m.dense.rows());
  fails[40] = fails[m.dense.rows() - 40] = -1e6;  // in both halves: the first one is reported
  EXPECT_FALSE(alone.factorize(m.values, fails));
  EXPECT_FALSE(shared.factorize(m.values, fails));
  EXPECT_EQ(alone.failed_unknown(), 40);
  EXPECT_EQ(shared.failed_unknown(), 40);
}

TEST(BlockCholesky, KeepsTheNaturalOrderIfAllowed) {
  const BlockMatrix wheel = star(30, 0, 2);
  const double dense = double(wheel.pattern.size()) * (wheel.pattern.size() + 1) / 2;
  BlockCholesky amd(wheel.pattern), natural(wheel.pattern, 1e9);
  EXPECT_LT(amd.nonzeros(), 0.5 * dense);
  EXPECT_EQ(natural.nonzeros(), dense) << "with the hub first";
  ASSERT_TRUE(amd.factorize(wheel.values) && natural.factorize(wheel.values));
  const Eigen::MatrixXd S = amd.inverse_of({29, 0, 7});
  EXPECT_LE((natural.inverse_of({29, 0, 7}) - S).norm(), 1e-10 * S.norm());
}

TEST(BlockCholesky, ColumnsOfTheInverseEqualSolves) {
  for (const BlockMatrix& m : {chain(30, 2, 3), star(20, 8, 4), long_chain(3, true, 2)})
    for (const double natural_flops : {BlockCholesky::kDefaultNaturalFlops, 1e9}) {
      BlockCholesky cholesky(m.pattern, natural_flops);
      ASSERT_TRUE(cholesky.factorize(m.values));
      const std::vector<int> blocks = {17, 2, 9, 19};
      const auto X = cholesky.columns_of_inverse(blocks);
      Eigen::Index column = 0;
      for (const int block : blocks)
        for (int i = 0; i < cholesky.dofs(block); ++i, ++column) {
          Eigen::VectorXd x = Eigen::VectorXd::Unit(m.dense.rows(), cholesky.first_unknown(block) + i);
          cholesky.solve(x);
          EXPECT_LE((X.col(column) - x).norm(), 1e-13 * x.norm()) << "block " << block;
        }
      EXPECT_TRUE(X.rightCols(X.cols() - column).isZero(0));
    }
}

TEST(BlockCholesky, CountsTheEntriesOfTheFactor) {
  const BlockMatrix m = make_matrix({2, 3, 1}, {{0, 1}, {1, 2}}, 7);
  EXPECT_EQ(BlockCholesky(m.pattern).nonzeros(), (3 + 6) + (6 + 3) + 1);
}

TEST(BlockCholesky, AddsTheShiftToTheDiagonal) {
  for (const BlockMatrix& m : {chain(10, 2, 3), star(10, 5, 4)}) {
    const Eigen::Index n = m.dense.rows();
    const Eigen::VectorXd shift = right_side(n).cwiseAbs() * 10.0, b = right_side(n);
    BlockCholesky cholesky(m.pattern);
    ASSERT_TRUE(cholesky.factorize(m.values, shift));
    Eigen::VectorXd x = b;
    cholesky.solve(x);
    const Eigen::MatrixXd shifted = m.dense + Eigen::MatrixXd(shift.asDiagonal());
    EXPECT_LE((shifted * x - b).norm(), 1e-12 * b.norm());
    ASSERT_TRUE(cholesky.factorize(m.values));  // the shift is not kept
    x = b;
    cholesky.solve(x);
    EXPECT_LE((m.dense * x - b).norm(), 1e-11 * b.norm());
  }
}

TEST(BlockCholesky, ReportsTheUnknownOfAFailedPivot) {
  for (const BlockMatrix& m : {chain(10, 2, 3), star(10, 5, 4), long_chain(2, true, 5)}) {
    for (const int unknown : {0, 7, m.pattern.size() / 2, m.pattern.size() - 1}) {
      Eigen::VectorXd shift = Eigen::VectorXd::Zero(m.dense.rows());
      shift[unknown] = -1e6;
      BlockCholesky cholesky(m.pattern);
      EXPECT_FALSE(cholesky.factorize(m.values, shift));
      EXPECT_EQ(cholesky.failed_unknown(), unknown);
      EXPECT_TRUE(cholesky.factorize(m.values));
      EXPECT_EQ(cholesky.failed_unknown(), -1);
      shift[unknown] = std::numeric_limits<double>::quiet_NaN();
      EXPECT_FALSE(cholesky.factorize(m.values, shift));
      EXPECT_EQ(cholesky.failed_unknown(), unknown);
    }
  }
}

/// The columns of P = L⁻ᵀ from solve_transposed satisfy PᵀHP = I, and solve_lower applies Pᵀ.
TEST(BlockCholesky, TriangularSolvesWhitenTheMatrix) {
  for (const BlockMatrix& m : {chain(8, 2, 3), star(8, 5, 4)}) {
    const Eigen::Index n = m.dense.rows();
    BlockCholesky cholesky(m.pattern);
    ASSERT_TRUE(cholesky.factorize(m.values));
    Eigen::MatrixXd P(n, n), PT(n, n), inverse(n, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      Eigen::VectorXd e = Eigen::VectorXd::Unit(n, k), f = e, g = e;
      cholesky.solve_transposed(e);
      cholesky.solve_lower(f);
      cholesky.solve(g);
      P.col(k) = e;
      PT.col(k) = f;
      inverse.col(k) = g;
    }
    EXPECT_LE((P.transpose() * m.dense * P - Eigen::MatrixXd::Identity(n, n)).norm(), 1e-11);
    EXPECT_LE((PT - P.transpose()).norm(), 1e-13 * P.norm());
    EXPECT_LE((P * PT - inverse).norm(), 1e-13 * inverse.norm());
  }
}

TEST(BlockCholesky, FindsNullDirectionsOfSingleUnknowns) {
  for (const BlockMatrix& full : {chain(10, 2, 3), star(10, 8, 4), long_chain(2, true, 6)}) {
    BlockMatrix m = full;
    const Eigen::Index n = m.dense.rows();
    const int late = n > 100 ? int(n) - 20 : 11;
    BlockCholesky cholesky(m.pattern);
    EXPECT_TRUE(cholesky.null_space(m.values, 1e-12, 6).empty());
    // Zero rows and columns give null directions along single unknowns, and keep the pattern.
    const std::vector<int> start = m.pattern.column_starts(), row = m.pattern.rows();
    for (const int planted : {3, late}) {
      for (int column = 0; column < m.pattern.size(); ++column)
        for (int k = start[std::size_t(column)]; k < start[std::size_t(column) + 1]; ++k)
          if (column == planted || row[std::size_t(k)] == planted) m.values[k] = 0.0;
      m.dense.row(planted).setZero();
      m.dense.col(planted).setZero();
    }
    const auto basis = cholesky.null_space(m.values, 1e-12, 6);
    ASSERT_EQ(basis.size(), 2u);
    for (const auto& v : basis) {
      EXPECT_NEAR(v.norm(), 1.0, 1e-14);
      EXPECT_LE((m.dense * v).norm(), 1e-12 * m.dense.norm());
      EXPECT_NEAR(v[3] * v[3] + v[late] * v[late], 1.0, 1e-12);
    }
    EXPECT_EQ(cholesky.null_space(m.values, 1e-12, 1).size(), 1u);
    ASSERT_EQ(m.dense.rows(), n);
  }
}

/// With differences along a chain only, a common shift of all blocks is a null direction.
TEST(BlockCholesky, FindsNullDirectionsAcrossBlocks) {
  constexpr int blocks = 20;
  std::vector<std::pair<int, int>> pairs;
  for (int b = 0; b + 1 < blocks; ++b) pairs.emplace_back(b, b + 1);
  BlockMatrix m = make_matrix(std::vector<int>(blocks, 3), pairs, 1);
  m.dense.setZero();
  for (int i = 0; i + 3 < 3 * blocks; ++i) {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(3 * blocks);
    row[i] = -1.0 - i % 5;
    row[i + 3] = 1.0 + i % 5;
    m.dense += row * row.transpose();
  }
  const std::vector<int> start = m.pattern.column_starts(), rows = m.pattern.rows();
  for (int c = 0; c < 3 * blocks; ++c)
    for (int k = start[std::size_t(c)]; k < start[std::size_t(c) + 1]; ++k)
      m.values[k] = m.dense(rows[std::size_t(k)], c);
  const auto basis = BlockCholesky(m.pattern).null_space(m.values, 1e-12, 6);
  ASSERT_EQ(basis.size(), 3u);
  for (const auto& v : basis) EXPECT_LE((m.dense * v).norm(), 1e-12 * m.dense.norm());
  EXPECT_EQ(BlockCholesky(m.pattern).null_space(m.values, 1e-12, 2).size(), 2u);
}

TEST(BlockCholesky, SolvesConcurrently) {
  const BlockMatrix m = chain(60, 3, 7);
  BlockCholesky cholesky(m.pattern);
  ASSERT_TRUE(cholesky.factorize(m.values));
  const Eigen::VectorXd b = right_side(m.values.size()).head(m.pattern.size());
  Eigen::VectorXd x = b;
  cholesky.solve(x);
  const Eigen::MatrixXd S = cholesky.inverse_of({3, 50});
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      Eigen::VectorXd y;
      for (int k = 0; k < 500; ++k) {
        y = t * b;
        cholesky.solve(y);
        wrong += !y.isApprox(t * x, 1e-12) || cholesky.inverse_of({3, 50}) != S;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST(BlockCholesky, FactorisesAndSolvesWithoutAllocating) {
  for (const BlockMatrix& m : {chain(30, 2, 3), star(20, 8, 4), long_chain(3, true, 2)}) {
    BlockCholesky cholesky(m.pattern);
    Eigen::VectorXd x = right_side(m.dense.rows());
    const Eigen::VectorXd shift = x.cwiseAbs();
    const long before = allocations;
    const bool done = cholesky.factorize(m.values, shift);
    cholesky.solve(x);
    cholesky.solve_lower(x);
    cholesky.solve_transposed(x);
    EXPECT_EQ(allocations - before, 0);
    EXPECT_TRUE(done);
  }
}

}  // namespace
}  // namespace tandem::testing
