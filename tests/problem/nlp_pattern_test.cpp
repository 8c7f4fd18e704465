#include <algorithm>
#include <functional>

#include <gtest/gtest.h>

#include "mixed_problem.hpp"

namespace tandem::testing {
namespace {

class NlpEvaluatorPattern : public ::testing::Test {
 protected:
  MixedProblem mixed;
  NlpEvaluator nlp{mixed.problem};
  Eigen::VectorXd delta = random_vector(nlp.num_unknowns(), 0.5, 3);
};

TEST_F(NlpEvaluatorPattern, IsSortedWithFullDiagonalBlocks) {
  const SymmetricPattern& h = nlp.hessian_pattern();
  ASSERT_EQ(h.num_blocks(), 6);
  const std::vector<int> start = h.column_starts(), rows = h.rows();
  ASSERT_EQ(h.nonzeros(), Eigen::Index(rows.size()));
  for (int block = 0; block < h.num_blocks(); ++block) {
    EXPECT_EQ(h.block_row[std::size_t(h.block_start[std::size_t(block)])], block);
    for (int c = h.first[std::size_t(block)]; c < h.first[std::size_t(block) + 1]; ++c) {
      const auto begin = rows.begin() + start[std::size_t(c)];
      const auto end = rows.begin() + start[std::size_t(c) + 1];
      EXPECT_EQ(*begin, h.first[std::size_t(block)]);
      EXPECT_TRUE(std::adjacent_find(begin, end, std::greater_equal<>()) == end);
    }
  }
  nlp.move_to(delta);
  Eigen::VectorXd g(nlp.num_unknowns()), H = hessian_values(nlp);
  nlp.linearize(g, H);
  const Eigen::MatrixXd full = dense(h, H);
  EXPECT_LE((full - full.transpose()).cwiseAbs().maxCoeff(), 1e-13 * full.cwiseAbs().maxCoeff())
      << "both triangles of the diagonal blocks are filled";
}

TEST_F(NlpEvaluatorPattern, HasOnlyPairsThatABlockReads) {
  const SymmetricPattern& h = nlp.hessian_pattern();
  for (int row = h.block_start[0]; row < h.block_start[1]; ++row)  // a shares blocks with b and c, not with p, q, s
    EXPECT_TRUE(h.block_row[std::size_t(row)] != 2 && h.block_row[std::size_t(row)] != 3 &&
                h.block_row[std::size_t(row)] != 5);
}

TEST_F(NlpEvaluatorPattern, FindReturnsTheLocationOfABlock) {
  const SymmetricPattern natural = nlp.hessian_pattern();
  for (const SymmetricPattern& h : {natural, reversed(natural)})
    for (int column = 0; column < h.num_blocks(); ++column)
      for (int b = h.block_start[std::size_t(column)]; b < h.block_start[std::size_t(column) + 1]; ++b) {
        const int row = h.block_row[std::size_t(b)];
        const int value = h.value_start[std::size_t(column)] + h.block_offset[std::size_t(b)];
        for (const bool transposed : {false, true}) {
          const auto found = transposed ? h.find(column, row) : h.find(row, column);
          EXPECT_EQ(found.entry, b);
          EXPECT_EQ(found.first_value, value);
          EXPECT_EQ(found.stride, h.height(column));
          EXPECT_EQ(found.transposed, transposed && row != column);
        }
      }
}

TEST_F(NlpEvaluatorPattern, OtherLayoutHasTheSameValues) {
  NlpEvaluator other(mixed.problem, SoftBoundRole::in_cost, reversed);
  const Eigen::VectorXd multipliers = random_vector(nlp.num_rows(), 2.0, 5);
  const auto all = [&](NlpEvaluator& p) {
    p.move_to(delta);
    const SymmetricPattern& pattern = p.hessian_pattern();
    Eigen::VectorXd g(p.num_unknowns()), H = hessian_values(p), jacobian(Eigen::Index(p.jacobian_pattern().row.size()));
    std::vector<Eigen::MatrixXd> matrices;
    p.linearize(g, H);
    matrices.push_back(dense(pattern, H));
    p.constraint_jacobian(jacobian);
    p.add_constraint_hessian(multipliers.cwiseAbs(), jacobian, H);
    matrices.push_back(dense(pattern, H));
    p.exact_hessian(1.3, multipliers, H);
    matrices.push_back(dense(pattern, H));
    p.curvature(multipliers, H);
    matrices.push_back(dense(pattern, H));
    return matrices;
  };
  const auto natural = all(nlp), in_other_layout = all(other);
  EXPECT_NE(nlp.hessian_pattern().nonzeros(), other.hessian_pattern().nonzeros());
  for (std::size_t i = 0; i < natural.size(); ++i)
    EXPECT_LE((natural[i] - in_other_layout[i]).cwiseAbs().maxCoeff(), 1e-14 * natural[i].cwiseAbs().maxCoeff()) << i;
}

TEST(NlpEvaluatorLayout, OtherLayoutHasTheSameMarginalPrior) {
  Problem problem;
  std::vector<Variable<SE3>> x;
  for (unsigned k = 0; k < 4; ++k) x.push_back(problem.add(SE3::Exp(random_vector(6, 0.4, k))));
  problem.minimize(Prior<SE3>{SE3()}, Gaussian(Vector<6>::Constant(0.3)), {x[0]});
  for (std::size_t k = 1; k < x.size(); ++k)
    problem.minimize(RelativePose<SE3>{SE3()}, Gaussian(Vector<6>::Constant(0.1)), {x[0], x[k]});
  problem.marginalize(x[0]);
  NlpEvaluator natural(problem), other(problem, SoftBoundRole::in_cost, reversed);
  std::vector<Eigen::MatrixXd> matrices;
  for (NlpEvaluator* p : {&natural, &other}) {
    p->move_to(random_vector(p->num_unknowns(), 0.2, 9));
    Eigen::VectorXd g(p->num_unknowns()), H = hessian_values(*p);
    p->linearize(g, H);
    matrices.push_back(dense(p->hessian_pattern(), H));
    p->exact_hessian(1.0, Eigen::VectorXd(0), H);
    matrices.push_back(dense(p->hessian_pattern(), H));
  }
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_GT(matrices[i].block(0, 6, 6, 6).norm(), 1.0) << "the marginal prior couples the remaining poses";
    EXPECT_LE((matrices[i] - matrices[i + 2]).norm(), 1e-8 * matrices[i].norm());
  }
}

}  // namespace
}  // namespace tandem::testing
