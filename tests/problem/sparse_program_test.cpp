#include <Eigen/SparseCholesky>
#include <gtest/gtest.h>

#include <tandem/problem/sparse_program.hpp>

#include "mixed_problem.hpp"

namespace tandem::testing {
namespace {

class SparseProgramTest : public ::testing::Test {
 protected:
  MixedProblem mixed;
  Program program{mixed.problem};
  Eigen::VectorXd delta = random_vector(program.num_unknowns(), 0.3, 5);
};

TEST_F(SparseProgramTest, is_the_program_at_its_point) {
  program.move_to(delta);
  const SparseProgram s = sparse(program);
  EXPECT_EQ(s.cost, program.cost());
  EXPECT_EQ(s.gradient, gradient(program));
  Eigen::VectorXd values(program.hessian_pattern().nonzeros()), g(program.num_unknowns());
  program.linearize(g, values);
  const Eigen::MatrixXd H = s.hessian, expected = dense(program.hessian_pattern(), values);
  EXPECT_EQ(H, H.transpose());
  EXPECT_LE((H - expected).cwiseAbs().maxCoeff(), 1e-14 * expected.cwiseAbs().maxCoeff());
  EXPECT_EQ(Eigen::MatrixXd(s.jacobian), dense_jacobian(program));
  Eigen::VectorXd c(program.num_rows());
  program.constraints(c);
  EXPECT_EQ(s.constraints, c);
  EXPECT_EQ(s.lower, program.lower());
  EXPECT_EQ(s.upper, program.upper());
}

TEST_F(SparseProgramTest, has_all_entries_whatever_the_layout) {
  Program other(mixed.problem, SoftBounds::in_cost, reversed);
  program.move_to(delta);
  const Eigen::MatrixXd H = sparse(program).hessian;
  other.move_to(delta);
  EXPECT_LE((Eigen::MatrixXd(sparse(other).hessian) - H).norm(), 1e-14 * H.norm());
}

TEST_F(SparseProgramTest, serves_a_solver_of_ones_own) {
  Problem problem;
  const auto x = problem.add(R3({4.0, -2.0, 1.0})), y = problem.add(R3());
  problem.minimize(Prior<R3>{R3({1.0, 2.0, 3.0})}, kUnit3, {x});
  problem.minimize(RelativePose<R3>{R3({0.5, 0.0, 0.0})}, kUnit3, {x, y});
  Program own(problem);
  const SparseProgram s = sparse(own);
  EXPECT_EQ(s.jacobian.rows(), 0);
  const Eigen::VectorXd step = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(s.hessian).solve(-s.gradient);
  own.move_to(step);
  own.recenter();
  EXPECT_LE((problem.value(y).vector() - Vector<3>(1.5, 2.0, 3.0)).norm(), 1e-14);
}

}  // namespace
}  // namespace tandem::testing
