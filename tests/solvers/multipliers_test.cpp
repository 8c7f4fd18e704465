#include <gmock/gmock.h>

#include <tandem/problem/sparse_nlp.hpp>

#include "cases.hpp"
#include "random_problems.hpp"

namespace tandem::testing {
namespace {

class WithMultipliers : public ::testing::TestWithParam<AnySolver> {};
std::vector<AnySolver> solvers_with_multipliers() {
  std::vector<AnySolver> solvers{any_solver("augmented_lagrangian", true, AugmentedLagrangianOptions{})};
  if (ipopt_present()) solvers.push_back(ipopt(Hessian::exact));
  return solvers;
}
INSTANTIATE_TEST_SUITE_P(Solvers, WithMultipliers, ::testing::ValuesIn(solvers_with_multipliers()), name_of);

TEST_P(WithMultipliers, AreStoredInTheBlocks) {
  Problem problem;
  const auto x = problem.add(R3({1.0, 1.0, 1.0}));
  problem.minimize(Prior<R3>{R3({2.0, -1.0, 5.0})}, Gaussian{1.0, 1.0, 1.0}, {x});
  const Block above = problem.subject_to(Prior<R3>{R3()}, at_most(10.0), {x});
  constexpr double free = std::numeric_limits<double>::infinity();
  const Block bounds = problem.subject_to(Prior<R3>{R3()}, Bounds<3>{{0.5, 0.0, -free}, {0.5, free, 2.0}}, {x});
  EXPECT_EQ(problem.multipliers(bounds), Eigen::VectorXd::Zero(3));
  ASSERT_TRUE(GetParam()(problem).converged());
  EXPECT_LE((problem.multipliers(bounds) - Vector<3>(1.5, -1.0, 3.0)).norm(), 1e-6);
  EXPECT_LE(problem.multipliers(above).norm(), 1e-6);
  problem.remove(above);
  EXPECT_LE((problem.multipliers(bounds) - Vector<3>(1.5, -1.0, 3.0)).norm(), 1e-6);
}

/// Compares the multiplier with the slope of the cost, where both the cost and the constraint are curved.
TEST_P(WithMultipliers, EqualTheSlopeOfTheCost) {
  const auto solve_at = [&](double radius) {
    Problem problem;
    const auto x = problem.add(R3({1.0, 1.0, 1.0}));
    problem.minimize(Prior<R3>{R3({2.0, -1.0, 2.0})}, Gaussian{0.5, 0.7, 0.9}, {x});
    const Block sphere = problem.subject_to(SquaredNorm{}, at_most(radius), {x});
    const Summary s = GetParam()(problem);
    EXPECT_TRUE(s.converged()) << s.message;
    return std::pair(s.cost, problem.multipliers(sphere)[0]);
  };
  const double h = 1e-3, slope = (solve_at(4.0 + h).first - solve_at(4.0 - h).first) / (2 * h);
  EXPECT_NEAR(solve_at(4.0).second, -slope, 1e-5 * std::abs(slope));
  EXPECT_NEAR(solve_at(16.0).second, 0.0, 1e-6);
}

TEST(Multipliers, AgreeBetweenSolvers) {
  if (!ipopt_present()) GTEST_SKIP() << "this build has no Ipopt";
  IpoptOptions exact;
  exact.hessian = Hessian::exact;
  int compared = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    RandomProblem a = random_problem(seed), b = random_problem(seed);
    if (!solve(a.problem, AugmentedLagrangianOptions{}).converged() || !solve(b.problem, exact).converged()) continue;
    if ((a.values() - b.values()).norm() > 1e-4) continue;  // another minimum
    Eigen::VectorXd of_a, of_b;
    NlpEvaluator in_a(a.problem), in_b(b.problem);
    of_a.resize(in_a.num_rows());
    of_b = of_a;
    in_a.multipliers(of_a);
    in_b.multipliers(of_b);
    const Eigen::MatrixXd J = Eigen::MatrixXd(sparse(in_a).jacobian).transpose();
    // Redundant rows have no unique multipliers, but Jᵀ y is unique.
    EXPECT_LE((J * (of_a - of_b)).norm(), 1e-3 * (1 + (J * of_b).norm())) << "seed " << seed;
    ++compared;
  }
  EXPECT_GE(compared, 40);
}

/// Chains of points with bounded speed. The second solve has slightly different measurements, like a recording that is
/// estimated again.
TEST_P(WithMultipliers, AccelerateTheNextSolve) {
  int cold = 0, warm = 0;
  for (const bool again : {false, true}) {
    Problem problem;
    std::vector<Variable<R2>> x;
    std::vector<Block> fixes;
    const auto fix = [](int k, double noise) {
      return Prior<R2>{R2({1.2 * k + 0.3 * std::sin(2.0 * k), std::sin(0.3 * k) + noise * std::cos(7.0 * k)})};
    };
    for (int k = 0; k < 60; ++k) {
      x.push_back(problem.add(R2()));
      fixes.push_back(problem.minimize(fix(k, 0.0), Gaussian{0.3, 0.3}, {x.back()}));
      if (k > 0)
        problem.subject_to(RelativePose<R2>{R2()}, Bounds<2>{{-1, -0.2}, {1.15, 0.2}},
                           {x[std::size_t(k) - 1], x.back()});
    }
    ASSERT_TRUE(GetParam()(problem).converged());
    for (int k = 0; k < 60; ++k) {
      problem.remove(fixes[std::size_t(k)]);
      problem.minimize(fix(k, 1e-3), Gaussian{0.3, 0.3}, {x[std::size_t(k)]});
    }
    Limits limits;
    limits.from_multipliers = again;
    const Summary s = GetParam()(problem, limits);
    ASSERT_TRUE(s.converged()) << s.message;
    (again ? warm : cold) = s.iterations;
  }
  EXPECT_LT(warm, cold);
}

TEST(Multipliers, RejectInvalidAccess) {
  Problem problem;
  const auto x = problem.add(R3());
  const Block soft = problem.minimize(Prior<R3>{R3()}, Gaussian{1.0, 1.0, 1.0}, {x});
  const Block hard = problem.subject_to(SquaredNorm{}, at_most(1.0), {x});
  EXPECT_THROW(problem.multipliers(soft), Error);
  EXPECT_THROW(problem.set_multipliers(soft, Vector<3>::Zero()), Error);
  EXPECT_THROW(problem.set_multipliers(hard, Vector<3>::Zero()), Error);
  EXPECT_THROW(problem.set_multipliers(hard, Vector<1>(std::numeric_limits<double>::quiet_NaN())), Error);
  problem.set_multipliers(hard, Vector<1>(0.5));
  EXPECT_EQ(problem.multipliers(hard)[0], 0.5);
  problem.remove(hard);
  EXPECT_THROW(problem.multipliers(hard), Error);
}

}  // namespace
}  // namespace tandem::testing
