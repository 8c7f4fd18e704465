#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <tandem/lie/se3.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/problem/subproblem.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>

/// Use that is documented as concurrent: const functions of one object, and different problems in different threads.
/// The thread sanitizer reports data races; the tests also compare results with those of a single thread.
namespace tandem::testing {
namespace {

constexpr int kThreads = 4;

/// Calls f(thread) in several threads that start together.
template <class F>
void concurrently(F f) {
  std::atomic<int> waiting{kThreads};
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i)
    threads.emplace_back([&, i] {
      for (--waiting; waiting > 0;) std::this_thread::yield();
      f(i);
    });
  for (std::thread& thread : threads) thread.join();
}

const Gaussian& noise() {
  static const Gaussian noise(Vector<6>::Constant(0.1));
  return noise;
}

/// Chain of poses, with a bound on the last one.
struct Chain {
  Problem problem;
  std::vector<Variable<SE3>> x;
  std::vector<Block> steps;
  Block bound;

  explicit Chain(int n, bool bounded = true) {
    const SE3 step(SO3::Exp({0.1, 0, 0.2}), {1, 0, 0});
    for (int i = 0; i < n; ++i) x.push_back(problem.add(SE3(), "x" + std::to_string(i)));
    problem.minimize(Prior<SE3>{}, noise(), {x[0]}, Cauchy(2.0));
    for (std::size_t i = 1; i < x.size(); ++i)
      steps.push_back(problem.minimize(RelativePose<SE3>{step}, noise(), {x[i - 1], x[i]}));
    if (bounded) bound = problem.subject_to(Prior<SE3>{}, at_most(6.0), {x.back()});
  }
};

TEST(ConcurrentUse, OfConstFunctionsOfOneProblem) {
  Chain chain(20);
  solve(chain.problem, AugmentedLagrangianOptions{});
  const Problem& problem = chain.problem;
  const Eigen::VectorXd residual = problem.linearization(chain.steps[3]).residual;
  concurrently([&](int thread) {
    for (int k = 0; k < 50; ++k) {
      const Variable<SE3> x = chain.x[std::size_t(k + thread) % chain.x.size()];  // handles may be copied
      EXPECT_TRUE(problem.has(x) && !problem.is_fixed(x));
      EXPECT_TRUE(problem.value(x).matrix().allFinite());
      EXPECT_EQ(problem.name(problem.id(x)).front(), 'x');
      EXPECT_THROW(problem.value(Variable<SE3>()), StaleHandleError);
      EXPECT_EQ(problem.linearization(chain.steps[3]).residual, residual);
      EXPECT_EQ(problem.multipliers(chain.bound).size(), 6);
      EXPECT_EQ(problem.noise(chain.steps[0]).dim(), 6);
      EXPECT_EQ(problem.weight(chain.steps[0]), 1.0);
      EXPECT_EQ(problem.describe(chain.bound), "prior of x19");
      EXPECT_EQ(problem.blocks().size(), 21u);
    }
    Problem copy = problem.copy();
    EXPECT_TRUE(solve(copy, AugmentedLagrangianOptions{}).converged());
  });
}

TEST(ConcurrentUse, OfDifferentProblems) {
  Chain alone(30);
  const double cost = solve(alone.problem, AugmentedLagrangianOptions{}).cost;
  concurrently([&](int) {
    Chain chain(30);
    EXPECT_EQ(solve(chain.problem, AugmentedLagrangianOptions{}).cost, cost) << "bitwise equal";
    chain.problem.remove(chain.bound);
    const Marginals marginals(chain.problem);
    chain.problem.marginalize(chain.x[0], chain.x[1]);
    EXPECT_TRUE(solve(chain.problem, GaussNewtonOptions{}).converged());
    FixedLagOptions options;
    options.window = 5;
    FixedLag lag(options);
    Variable<SE3> last;
    for (int t = 0; t < 12; ++t) {
      const Variable<SE3> x = lag.add(t, SE3());
      if (t == 0) lag.problem().minimize(Prior<SE3>{}, noise(), {x});
      if (t > 0) lag.problem().minimize(RelativePose<SE3>{}, noise(), {last, x});
      EXPECT_TRUE(lag.update().converged());
      last = x;
    }
    EXPECT_TRUE(lag.covariance(last).allFinite());
  });
}

TEST(ConcurrentUse, OfMarginals) {
  Chain chain(20, false);
  solve(chain.problem, GaussNewtonOptions{});
  const Marginals marginals(chain.problem);
  const Matrix<12, 12> first = marginals.joint(chain.x[2], chain.x[15]);
  chain.problem.remove(chain.steps.back());
  chain.problem.remove(chain.x.back());
  concurrently([&](int) {
    for (int k = 0; k < 20; ++k) {
      EXPECT_EQ((marginals.joint(chain.x[2], chain.x[15])), first);  // not stored: solves
      EXPECT_GT(marginals.covariance(chain.x.back())(0, 0), 0) << "of a variable that was removed since";
    }
  });
}

TEST(ConcurrentUse, OfCovariancesOfOneSmoother) {
  for (const bool constrained : {false, true}) {
    const auto smoother = [&](std::vector<Variable<SE3>>& x) {
      FixedLag lag{FixedLagOptions{}};
      for (int t = 0; t < 8; ++t) {
        x.push_back(lag.add(t, SE3()));
        if (t == 0) lag.problem().minimize(Prior<SE3>{}, noise(), {x[0]});
        if (t > 0) lag.problem().minimize(RelativePose<SE3>{}, noise(), {x[x.size() - 2], x.back()});
      }
      if (constrained) lag.problem().subject_to(RelativePose<SE3>{}, equal_to(0), {x[3], x[4]});
      EXPECT_TRUE(lag.update().converged());
      return lag;
    };
    std::vector<Variable<SE3>> x, same;
    const FixedLag lag = smoother(x), alone = smoother(same);
    const Matrix<12, 12> last = alone.covariance(same[7], same[2]);
    concurrently([&](int thread) {
      for (int k = 0; k < 8; ++k) EXPECT_GT(lag.covariance(x[std::size_t(k + thread) % 8])(0, 0), 0);
      EXPECT_EQ((lag.covariance(x[7], x[2])), last);
    });
  }
}

TEST(ConcurrentUse, OfPartsOfOneProblem) {
  Chain chain(20, false);
  std::vector<std::unique_ptr<Subproblem>> parts;
  for (int thread = 0; thread < kThreads; ++thread) {
    const int ids[] = {chain.problem.id(chain.x[std::size_t(5 * thread)])};
    parts.push_back(std::make_unique<Subproblem>(chain.problem, ids));
  }
  concurrently(
      [&](int thread) { EXPECT_TRUE(solve(parts[std::size_t(thread)]->problem(), GaussNewtonOptions{}).converged()); });
  const double before = NlpEvaluator(chain.problem).cost();
  for (const auto& part : parts) part->write_back();
  EXPECT_LT(NlpEvaluator(chain.problem).cost(), before);
}

}  // namespace
}  // namespace tandem::testing
