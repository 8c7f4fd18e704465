#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <tandem/residuals/outside.hpp>

#include "mixed_problem.hpp"

/// What is wrong with a residual near a point: nothing, a jump, or its Jacobian.
namespace tandem::testing {
namespace {

using Kind = Program::Doubt::Kind;

/// Its Jacobian has the wrong sign in one entry.
struct Mistaken {
  static constexpr std::string_view name = "mistaken";
  static constexpr int dim = 2;
  using States = std::tuple<R2>;
  void operator()(const R2& x, Vector<2>& r, Matrix<2, 2>* J = nullptr) const {
    r << std::sin(x.vector()[0]), x.vector()[0] * x.vector()[1];
    if (J) *J << std::cos(x.vector()[0]), 0, -x.vector()[1], x.vector()[0];
  }
};

TEST(Doubt, NoneOfSmoothResiduals) {
  MixedProblem mixed;
  Program program(mixed.problem);
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Eigen::VectorXd direction = random_vector(program.num_unknowns(), 1.0, seed);
    const Program::Doubt doubt = program.doubt(direction);
    EXPECT_EQ(doubt.kind, Kind::none) << doubt.block;
  }
}

TEST(Doubt, ARotationByPiJumps) {
  Problem problem;
  const auto x = problem.add(SO3::Exp({0, 0, std::numbers::pi - 1e-8}), "x"), y = problem.add(SO3(), "y");
  problem.minimize(Prior<SO3>{SO3()}, kUnit3, {y});
  problem.minimize(Prior<SO3>{SO3()}, kUnit3, {x});
  Program program(problem);
  Eigen::VectorXd direction = Eigen::VectorXd::Zero(6);
  direction[2] = -2.0;  // either way
  const Program::Doubt doubt = program.doubt(direction);
  EXPECT_EQ(doubt.kind, Kind::jump);
  EXPECT_EQ(doubt.block, "prior of x");
  direction.setZero();
  direction[5] = 1.0;
  EXPECT_EQ(program.doubt(direction).kind, Kind::none);
  problem.set_value(x, SO3::Exp({0, 0, std::numbers::pi - 0.01}));
  program.reset();
  direction[2] = 1.0;
  EXPECT_EQ(program.doubt(direction).kind, Kind::none);
}

TEST(Doubt, NoneOfAMarginalPriorWithoutRows) {
  Problem problem;
  const auto x = problem.add(R2({0.3, 0.7})), alone = problem.add(R2());
  problem.minimize(Prior<R2>{R2()}, Gaussian{1.0, 1.0}, {x});
  problem.minimize(Prior<R2>{R2()}, Gaussian{1.0, 1.0}, {alone});
  problem.marginalize(alone);
  Program program(problem);
  EXPECT_EQ(program.doubt(Eigen::VectorXd::Ones(2)).kind, Kind::none);
}

TEST(Doubt, AWrongJacobianIsNamed) {
  Problem problem;
  const auto a = problem.add(R2({0.3, 0.7}), "a");
  problem.minimize(Mistaken{}, Gaussian{1.0, 1.0}, {a});
  Program program(problem);
  const Program::Doubt doubt = program.doubt(Eigen::Vector2d(0.5, 0.2));
  EXPECT_EQ(doubt.kind, Kind::jacobian);
  EXPECT_EQ(doubt.block, "mistaken of a");
  EXPECT_EQ(program.doubt(Eigen::Vector2d(0.0, 1.0)).kind, Kind::none);  // that column is right
}

TEST(Doubt, ABendIsNeither) {
  Problem problem;
  const auto x = problem.add(Rn<1>(Vector<1>(0.0)), "x");
  problem.minimize(Outside{Prior<Rn<1>>{Rn<1>()}, at_most(0.0)}, Gaussian{1.0}, {x});
  Program program(problem);
  EXPECT_EQ(program.doubt(Eigen::VectorXd::Constant(1, 1.0)).kind, Kind::none);
}

}  // namespace
}  // namespace tandem::testing
