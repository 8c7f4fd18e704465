#include <Eigen/SparseCholesky>
#include <gtest/gtest.h>

#include <tandem/problem/sparse_nlp.hpp>

#include "mixed_problem.hpp"

namespace tandem::testing {
namespace {

class SparseNlpTest : public ::testing::Test {
 protected:
  MixedProblem mixed;
  NlpEvaluator nlp{mixed.problem};
  Eigen::VectorXd delta = random_vector(nlp.num_unknowns(), 0.3, 5);
};

TEST_F(SparseNlpTest, MatchesEvaluatorAtItsPoint) {
  nlp.move_to(delta);
  const SparseNlp s = sparse(nlp);
  EXPECT_EQ(s.cost, nlp.cost());
  EXPECT_EQ(s.gradient, gradient(nlp));
  Eigen::VectorXd values(nlp.hessian_pattern().nonzeros()), g(nlp.num_unknowns());
  nlp.linearize(g, values);
  const Eigen::MatrixXd H = s.hessian, expected = dense(nlp.hessian_pattern(), values);
  EXPECT_EQ(H, H.transpose());
  EXPECT_LE((H - expected).cwiseAbs().maxCoeff(), 1e-14 * expected.cwiseAbs().maxCoeff());
  EXPECT_EQ(Eigen::MatrixXd(s.jacobian), dense_jacobian(nlp));
  Eigen::VectorXd c(nlp.num_rows());
  nlp.constraints(c);
  EXPECT_EQ(s.constraints, c);
  EXPECT_EQ(s.lower, nlp.lower());
  EXPECT_EQ(s.upper, nlp.upper());
}

TEST_F(SparseNlpTest, IsIndependentOfTheLayout) {
  NlpEvaluator other(mixed.problem, SoftBoundRole::in_cost, reversed);
  nlp.move_to(delta);
  const Eigen::MatrixXd H = sparse(nlp).hessian;
  other.move_to(delta);
  EXPECT_LE((Eigen::MatrixXd(sparse(other).hessian) - H).norm(), 1e-14 * H.norm());
}

TEST_F(SparseNlpTest, SolvesWithEigen) {
  Problem problem;
  const auto x = problem.add(R3({4.0, -2.0, 1.0})), y = problem.add(R3());
  problem.minimize(Prior<R3>{R3({1.0, 2.0, 3.0})}, kUnit3, {x});
  problem.minimize(RelativePose<R3>{R3({0.5, 0.0, 0.0})}, kUnit3, {x, y});
  NlpEvaluator own(problem);
  const SparseNlp s = sparse(own);
  EXPECT_EQ(s.jacobian.rows(), 0);
  const Eigen::VectorXd step = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(s.hessian).solve(-s.gradient);
  own.move_to(step);
  own.recenter();
  EXPECT_LE((problem.value(y).vector() - Vector<3>(1.5, 2.0, 3.0)).norm(), 1e-14);
}

}  // namespace
}  // namespace tandem::testing
