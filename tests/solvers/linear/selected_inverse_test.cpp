#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <tandem/solvers/linear/selected_inverse.hpp>

#include "block_matrix.hpp"

namespace tandem::testing {
namespace {

using detail::SelectedInverse;
using detail::WhitenedRows;

/// A chain of blocks of two unknowns, position and velocity, with the rows of its least-squares problem.
struct Chain {
  BlockMatrix matrix;
  std::vector<WhitenedRows> rows;
  Eigen::MatrixXd J;
  Eigen::VectorXd r;

  Chain(int blocks, double prior) {
    std::vector<std::pair<int, int>> pairs;
    for (int b = 0; b + 1 < blocks; ++b) pairs.emplace_back(b, b + 1);
    matrix = make_matrix(std::vector<int>(std::size_t(blocks), 2), pairs, 1);
    std::mt19937_64 random(2);
    std::normal_distribution<double> normal;
    const auto add = [&](std::vector<int> of, Eigen::MatrixXd A) {
      Eigen::VectorXd residual = Eigen::VectorXd::NullaryExpr(A.rows(), [&] { return normal(random); });
      rows.push_back({std::move(of), std::move(A), std::move(residual)});
    };
    add({0}, prior * Eigen::Matrix2d::Identity());
    for (int b = 0; b + 1 < blocks; ++b) {
      Eigen::MatrixXd A(2, 4);
      A << -1, -1, 1, 0, 0, -1, 0, 1;
      add({b, b + 1}, A);
    }
    J = Eigen::MatrixXd::Zero(2 * Eigen::Index(rows.size()), 2 * blocks);
    r.resize(J.rows());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t k = 0; k < rows[i].blocks.size(); ++k)
        J.block<2, 2>(2 * Eigen::Index(i), 2 * rows[i].blocks[k]) = rows[i].J.middleCols<2>(2 * Eigen::Index(k));
      r.segment<2>(2 * Eigen::Index(i)) = rows[i].r;
    }
  }
};

TEST(SelectedInverse, FromRowsEqualsADenseInverse) {
  const Chain chain(30, 0.5);
  SelectedInverse inverse(chain.matrix.pattern);
  ASSERT_TRUE(inverse.compute_from_rows(chain.rows));
  const Eigen::MatrixXd H = chain.J.transpose() * chain.J, S = H.inverse();
  EXPECT_NEAR(inverse.log_determinant(), std::log(H.determinant()), 1e-9);
  const Eigen::VectorXd gradient = chain.J.transpose() * chain.r, step = -S * gradient;
  EXPECT_LE((inverse.minimizer() - step).norm(), 1e-8 * step.norm());
  EXPECT_NEAR(inverse.decrease(), -0.5 * gradient.dot(step), 1e-8);
  EXPECT_LE((inverse.times(gradient) + step).norm(), 1e-8 * step.norm());
  Eigen::MatrixXd block(2, 2);
  inverse.block(12, 13, block);
  EXPECT_LE((block - S.block<2, 2>(24, 26)).norm(), 1e-8 * block.norm());
}

/// det H is the square of that of the prior, however small. Rounding would hide it in H.
TEST(SelectedInverse, FromRowsIsAccurateWhereTheHessianIsNumericallySingular) {
  for (const double prior : {1e-3, 1e-8}) {
    const Chain chain(1000, prior);
    SelectedInverse inverse(chain.matrix.pattern);
    ASSERT_TRUE(inverse.compute_from_rows(chain.rows));
    EXPECT_NEAR(inverse.log_determinant(), 4 * std::log(prior), 1e-4) << prior;
    for (std::size_t i = 0; i < chain.rows.size(); i += 99) {  // as many rows as unknowns: J S Jᵀ = I
      const Eigen::MatrixXd V = inverse.propagated(chain.rows[i].blocks, chain.rows[i].J);
      EXPECT_LE((V - Eigen::Matrix2d::Identity()).norm(), 1e-6) << prior << " row " << i;
    }
  }
}

TEST(SelectedInverse, RowsThatDoNotDetermineAllUnknownsAreReported) {
  const Chain chain(20, 0);
  SelectedInverse inverse(chain.matrix.pattern);
  EXPECT_FALSE(inverse.compute_from_rows(chain.rows));
  EXPECT_GE(inverse.failed_unknown(), 0);
}

}  // namespace
}  // namespace tandem::testing
