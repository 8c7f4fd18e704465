#include <bit>
#include <cstdint>

#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/problem/parallel_tasks.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/ipopt.hpp>

#include "../problem/tracking/simulated_tracking.hpp"
#include "sanitized.hpp"

namespace tandem::testing {
namespace {

constexpr double kLong = 720.0;  // [s]; gives 8,640 unknowns, enough for parallel loops over vectors

/// Solution of a tracking problem: its cost and all poses.
struct Solved {
  Summary summary;
  std::vector<double> numbers;
};

template <class Options>
Solved solved(Options options, Role constraints, double seconds, int threads) {
  TrackingOptions model;
  model.non_holonomic = constraints;
  if (constraints == Role::hard) model.surge = between(0.0, 2.5);
  TrackingProblem tracking = make_tracking_problem(noisy(seconds).data(), model);
  EXPECT_GE(tracking.problem.num_soft_blocks(), 1000) << "enough for several tasks";
  options.threads = threads;
  Solved result{solve(tracking.problem, options), {}};
  result.numbers = {result.summary.initial_cost, result.summary.cost, result.summary.max_violation};
  for (const auto& variables : {poses(tracking.chaser), poses(tracking.target)})
    for (const Variable<SE3>& x : variables) {
      const Eigen::Matrix4d T = tracking.problem.value(x).matrix();
      result.numbers.insert(result.numbers.end(), T.data(), T.data() + T.size());
    }
  return result;
}

template <class Options>
void expect_same_for_any_threads(const Options& options, Role constraints, double seconds) {
  const ThreadLimit more_than_cores(7);
  const Solved one = solved(options, constraints, seconds, 1);
  EXPECT_TRUE(one.summary.converged()) << one.summary.message;
  for (const int threads : {3, 0, 2, 7}) {
    if (kSanitized && threads != 3) break;
    const Solved many = solved(options, constraints, seconds, threads);
    EXPECT_EQ(many.summary.message, one.summary.message);
    EXPECT_EQ(many.summary.iterations, one.summary.iterations);
    EXPECT_EQ(many.summary.evaluations, one.summary.evaluations);
    ASSERT_EQ(many.numbers.size(), one.numbers.size());
    for (std::size_t i = 0; i < one.numbers.size(); ++i)
      ASSERT_EQ(std::bit_cast<std::uint64_t>(many.numbers[i]), std::bit_cast<std::uint64_t>(one.numbers[i]))
          << threads << " threads, number " << i;
  }
}

TEST(Threads, HaveNoEffectOnASoftSolve) { expect_same_for_any_threads(GaussNewtonOptions{}, Role::soft, kLong); }

TEST(Threads, HaveNoEffectOnAConstrainedSolve) {
  expect_same_for_any_threads(AugmentedLagrangianOptions{}, Role::hard, kLong);
}

TEST(Threads, HaveNoEffectOnIpoptWithExactHessians) {
  if (!ipopt_available()) GTEST_SKIP() << "Tandem was built without Ipopt";
  IpoptOptions options;
  options.hessian = Hessian::exact;
  expect_same_for_any_threads(options, Role::hard, 240.0);
}

TEST(Threads, RejectANegativeNumber) {
  GaussNewtonOptions options;
  options.threads = -1;
  Problem problem;
  const auto x = problem.add(R3());
  problem.minimize(Prior<R3>{R3()}, Gaussian{1.0, 1.0, 1.0}, {x});
  EXPECT_THROW(solve(problem, options), Error);
}

}  // namespace
}  // namespace tandem::testing
