#include <array>
#include <random>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include <tandem/problem/block.hpp>

namespace tandem::detail {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

/// Block of five states: the second one is fixed, the first and the fourth are the same variable, and the last one
/// comes first in the matrix. The sizes 6 and 3 have kernels of fixed size.
template <int dim>
struct BlockOf {
  static constexpr int kStates = 5, kUnknowns = 6 + 2 + 9;
  std::array<int, kStates> dofs{6, 3, 9, 6, 2};
  std::array<int, kStates> offset{2, -1, 8, 2, 0};
  BlockShape shape{dim, kStates, dofs.data(), offset.data()};
  std::vector<MatrixXd> J, charts;
  std::vector<HessianPlace> place;
  MatrixXd H = MatrixXd::Zero(kUnknowns, kUnknowns);
  VectorXd gradient = VectorXd::Zero(kUnknowns);
  VectorXd r;

  BlockOf() : r(random(dim, 1)) {
    for (int s = 0; s < kStates; ++s) {
      J.push_back(random(dim, dofs[std::size_t(s)]));
      charts.push_back(random(dofs[std::size_t(s)], dofs[std::size_t(s)]));
    }
    for (int a = 0; a < kStates; ++a)  // the lower triangle of a dense matrix
      for (int b = 0; b <= a; ++b) {
        const int at_a = offset[std::size_t(a)], at_b = offset[std::size_t(b)];
        const int row = std::max(at_a, at_b), column = std::min(at_a, at_b);
        place.push_back(column < 0 ? HessianPlace{} : HessianPlace{column * kUnknowns + row, kUnknowns, at_a < at_b});
      }
  }
  static MatrixXd random(int rows, int columns) {
    static std::mt19937 engine(1);
    std::normal_distribution<double> normal;
    return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(engine); });
  }
  std::vector<const double*> pointers(const std::vector<MatrixXd>& of) const {
    std::vector<const double*> result;
    for (const MatrixXd& m : of) result.push_back(m.data());
    return result;
  }
  std::vector<double*> columns() {
    std::vector<double*> result;
    for (MatrixXd& m : J) result.push_back(m.data());
    return result;
  }
  /// Returns the Jacobian with respect to all unknowns; if `charts` is given, through the charts.
  MatrixXd dense(const std::vector<MatrixXd>* charts = nullptr) const {
    MatrixXd sum = MatrixXd::Zero(dim, kUnknowns);
    for (std::size_t s = 0; s < kStates; ++s)
      if (offset[s] >= 0) sum.middleCols(offset[s], dofs[s]) += charts ? J[s] * (*charts)[s] : J[s];
    return sum;
  }
  /// Returns H with its upper triangle copied from the lower one.
  MatrixXd symmetric() const { return H.selfadjointView<Eigen::Lower>(); }
};

template <class T>
class Block : public testing::Test {};
using Rows =
    testing::Types<std::integral_constant<int, 1>, std::integral_constant<int, 3>, std::integral_constant<int, 6>>;
TYPED_TEST_SUITE(Block, Rows);

TYPED_TEST(Block, HessianMatchesDenseProducts) {
  constexpr int dim = TypeParam::value;
  BlockOf<dim> b;
  std::vector<double> T;  // of each state, one after the other
  for (const MatrixXd& J : b.J) {
    const MatrixXd weighted = 0.7 * J.transpose();
    T.insert(T.end(), weighted.data(), weighted.data() + weighted.size());
  }
  block_kernels(dim).add_products(b.shape, b.place.data(), T.data(), b.columns().data(), b.H.data());
  const MatrixXd J = b.dense();
  EXPECT_LT((b.symmetric() - 0.7 * J.transpose() * J).norm(), 1e-11);
}

/// Compares add_soft_block() with dense products.
template <int dim>
void expect_soft_block() {
  const VectorXd d = BlockOf<dim>::random(dim, 1).cwiseAbs();
  const MatrixXd full = BlockOf<dim>::random(dim, dim);
  for (const bool diagonal : {true, false})
    for (const Loss& loss : {Loss{}, Loss{Loss::Kind::cauchy, 1.5}}) {
      BlockOf<dim> b;
      const MatrixXd W = diagonal ? MatrixXd(d.asDiagonal()) : full, J = W * b.dense();
      const VectorXd r = W * b.r;
      const Loss::Value value = loss(r.squaredNorm());
      std::vector<double> T(std::size_t(dim * b.shape.first(b.shape.arity)));
      const BlockWeight weight{d.data(), diagonal ? nullptr : full.data(), loss};
      const std::vector<double*> columns = b.columns();
      const double cost = block_kernels(dim).add_soft_block(
          b.shape, b.place.data(), weight, {b.r.data(), columns.data(), T.data()}, b.gradient.data(), b.H.data());
      EXPECT_NEAR(cost, 0.5 * value.rho, 1e-13 * (1 + cost));
      EXPECT_LT((b.gradient - value.d1 * J.transpose() * r).norm(), 1e-12 * (1 + J.norm() * r.norm()));
      EXPECT_LT((b.symmetric() - value.d1 * J.transpose() * J).norm(), 1e-12 * (1 + J.squaredNorm()));
    }
}
TYPED_TEST(Block, AddSoftBlockAppliesNoiseAndLoss) { expect_soft_block<TypeParam::value>(); }
TEST(BlockOfOtherSize, AddSoftBlockAppliesNoiseAndLoss) {
  expect_soft_block<2>();
  expect_soft_block<5>();  // without a kernel for this size
}

TYPED_TEST(Block, ApplyChartsMultipliesFromTheRight) {
  constexpr int dim = TypeParam::value;
  BlockOf<dim> b;
  const MatrixXd expected = b.dense(&b.charts);
  auto charts = b.pointers(b.charts);
  block_kernels(dim).apply_charts(b.shape, charts.data(), b.columns().data());
  EXPECT_LT((b.dense() - expected).norm(), 1e-12);
}

TYPED_TEST(Block, AddBlockCurvatureAppliesCharts) {
  constexpr int dim = TypeParam::value;
  BlockOf<dim> b;
  const int n = b.shape.first(b.shape.arity);
  const MatrixXd half = b.random(n, n), C = half + half.transpose();
  auto charts = b.pointers(b.charts);
  charts[2] = nullptr;
  b.charts[2].setIdentity();
  add_block_curvature(b.shape, b.place.data(), b.columns().data(), charts.data(), b.r.data(), C.data(),
                      b.gradient.data(), b.H.data());
  MatrixXd all = MatrixXd::Zero(n, b.kUnknowns);  // derivative of the block's states
  for (int s = 0; s < b.kStates; ++s)
    if (b.offset[std::size_t(s)] >= 0)
      all.block(b.shape.first(s), b.offset[std::size_t(s)], b.dofs[std::size_t(s)], b.dofs[std::size_t(s)]) =
          b.charts[std::size_t(s)];
  EXPECT_LT((b.symmetric() - all.transpose() * C * all).norm(), 1e-10);
  EXPECT_LT((b.gradient - b.dense().transpose() * b.r).norm(), 1e-12);
}

TYPED_TEST(Block, WhitensWithDiagonalOrFullMatrix) {
  constexpr int dim = TypeParam::value;
  const MatrixXd A = BlockOf<dim>::random(dim, 5), W = BlockOf<dim>::random(dim, dim);
  const VectorXd d = BlockOf<dim>::random(dim, 1);
  MatrixXd by_matrix = A, by_diagonal = A;
  whiten(dim, 5, d.data(), W.data(), by_matrix.data());
  whiten(dim, 5, d.data(), nullptr, by_diagonal.data());
  EXPECT_LT((by_matrix - W * A).norm(), 1e-12);
  EXPECT_LT((by_diagonal - d.asDiagonal() * A).norm(), 1e-12);
}

}  // namespace
}  // namespace tandem::detail
