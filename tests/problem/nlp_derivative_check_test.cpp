#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <tandem/residuals/soft_bound.hpp>

#include "mixed_problem.hpp"

/// NlpEvaluator::check_derivatives for smooth residuals, jumps and wrong Jacobians.
namespace tandem::testing {
namespace {

using Kind = NlpEvaluator::DerivativeCheck::Kind;

/// Residual whose Jacobian has the wrong sign in one entry.
struct WrongSign {
  static constexpr std::string_view name = "wrong sign";
  static constexpr int dim = 2;
  using States = std::tuple<R2>;
  void operator()(const R2& x, Vector<2>& r, Matrix<2, 2>* J = nullptr) const {
    r << std::sin(x.vector()[0]), x.vector()[0] * x.vector()[1];
    if (J) *J << std::cos(x.vector()[0]), 0, -x.vector()[1], x.vector()[0];
  }
};

TEST(DerivativeCheck, AcceptsSmoothResiduals) {
  MixedProblem mixed;
  NlpEvaluator nlp(mixed.problem);
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Eigen::VectorXd direction = random_vector(nlp.num_unknowns(), 1.0, seed);
    const NlpEvaluator::DerivativeCheck check = nlp.check_derivatives(direction);
    EXPECT_EQ(check.kind, Kind::none) << check.block;
  }
}

TEST(DerivativeCheck, ReportsJumpOfARotationAtPi) {
  Problem problem;
  const auto x = problem.add(SO3::Exp({0, 0, std::numbers::pi - 1e-8}), "x"), y = problem.add(SO3(), "y");
  problem.minimize(Prior<SO3>{SO3()}, kUnit3, {y});
  problem.minimize(Prior<SO3>{SO3()}, kUnit3, {x});
  NlpEvaluator nlp(problem);
  Eigen::VectorXd direction = Eigen::VectorXd::Zero(6);
  direction[2] = -2.0;  // the sign does not matter
  const NlpEvaluator::DerivativeCheck check = nlp.check_derivatives(direction);
  EXPECT_EQ(check.kind, Kind::jump);
  EXPECT_EQ(check.block, "prior of x");
  direction.setZero();
  direction[5] = 1.0;
  EXPECT_EQ(nlp.check_derivatives(direction).kind, Kind::none);
  problem.set_value(x, SO3::Exp({0, 0, std::numbers::pi - 0.01}));
  nlp.reset();
  direction[2] = 1.0;
  EXPECT_EQ(nlp.check_derivatives(direction).kind, Kind::none);
}

TEST(DerivativeCheck, AcceptsMarginalPriorWithoutRows) {
  Problem problem;
  const auto x = problem.add(R2({0.3, 0.7})), alone = problem.add(R2());
  problem.minimize(Prior<R2>{R2()}, Gaussian{1.0, 1.0}, {x});
  problem.minimize(Prior<R2>{R2()}, Gaussian{1.0, 1.0}, {alone});
  problem.marginalize(alone);
  NlpEvaluator nlp(problem);
  EXPECT_EQ(nlp.check_derivatives(Eigen::VectorXd::Ones(2)).kind, Kind::none);
}

TEST(DerivativeCheck, NamesBlockWithWrongJacobian) {
  Problem problem;
  const auto a = problem.add(R2({0.3, 0.7}), "a");
  problem.minimize(WrongSign{}, Gaussian{1.0, 1.0}, {a});
  NlpEvaluator nlp(problem);
  const NlpEvaluator::DerivativeCheck check = nlp.check_derivatives(Eigen::Vector2d(0.5, 0.2));
  EXPECT_EQ(check.kind, Kind::jacobian);
  EXPECT_EQ(check.block, "wrong sign of a");
  EXPECT_EQ(nlp.check_derivatives(Eigen::Vector2d(0.0, 1.0)).kind, Kind::none);  // this column is correct
}

TEST(DerivativeCheck, AcceptsKinks) {
  Problem problem;
  const auto x = problem.add(Rn<1>(Vector<1>(0.0)), "x");
  problem.minimize(SoftBound{Prior<Rn<1>>{Rn<1>()}, at_most(0.0)}, Gaussian{1.0}, {x});
  NlpEvaluator nlp(problem);
  EXPECT_EQ(nlp.check_derivatives(Eigen::VectorXd::Constant(1, 1.0)).kind, Kind::none);
}

}  // namespace
}  // namespace tandem::testing
