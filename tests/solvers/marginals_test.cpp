#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/linear/block_symbolic.hpp>

#include "problem/tracking/simulated_tracking.hpp"
#include "solvers/marginals_cases.hpp"

namespace tandem::testing {
namespace {

constexpr double kTolerance = 1e-10;

Vector<6> wave(double phase) {
  Vector<6> v;
  for (int i = 0; i < 6; ++i) v[i] = 0.3 * std::sin(phase + 1.7 * i);
  return v;
}

/// Chain of poses with additional relative poses between pairs.
struct PoseGraph {
  Problem problem;
  std::vector<Variable<SE3>> x;

  PoseGraph(int n, const std::vector<std::pair<int, int>>& loops) {
    for (int k = 0; k < n; ++k) x.push_back(problem.add(SE3::Exp(wave(k)), "pose " + std::to_string(k)));
    problem.minimize(Prior<SE3>{SE3()}, Gaussian(Vector<6>(0.1, 0.2, 0.3, 0.1, 0.2, 0.1)), {x[0]});
    for (int k = 1; k < n; ++k) tie(k - 1, k);
    for (const auto& [a, b] : loops) tie(a, b);
  }
  void tie(int a, int b) {
    problem.minimize(RelativePose<SE3>{SE3::Exp(wave(3.0 * a + b))},
                     Gaussian(Vector<6>(0.1, 0.1, 0.2, 0.05, 0.05, 0.1)), {x[std::size_t(a)], x[std::size_t(b)]});
  }
};

TEST(Marginals, MatchTheNoiseOfOneVariable) {
  Problem problem;
  const auto x = problem.add(R3({1, 2, 3}));
  problem.minimize(Prior<R3>{R3()}, Gaussian{0.1, 2.0, 30.0}, {x});
  const Matrix<3, 3> S = Marginals(problem).covariance(x);
  EXPECT_TRUE(S.isApprox(Vector<3>(0.01, 4.0, 900.0).asDiagonal().toDenseMatrix(), 1e-14)) << S;
}

TEST(Marginals, MatchTheDenseMethodForAChain) {
  PoseGraph graph(12, {});
  const Comparison c = compare(graph.problem, graph.x);
  EXPECT_LE(c.error, kTolerance);
  EXPECT_EQ(c.outside, 11 * 10) << "all pairs but neighbours";
}

TEST(Marginals, MatchTheDenseMethodForLoops) {
  std::vector<std::pair<int, int>> star{{0, 7}, {3, 11}, {5, 14}};
  for (int k = 2; k < 20; k += 2) star.emplace_back(0, k);
  PoseGraph graph(20, star);
  {
    const NlpEvaluator nlp(graph.problem);
    const auto symbolic = detail::analyze(nlp.hessian_pattern(), BlockCholesky::kDefaultNaturalFlops, true);
    ASSERT_FALSE(std::is_sorted(symbolic.order.begin(), symbolic.order.end()));
  }
  const Comparison c = compare(graph.problem, graph.x);
  EXPECT_LE(c.error, kTolerance);
  EXPECT_GT(c.outside, 0);
}

/// Costs of several groups with robust losses in both of their regions, without constraints.
struct MixedCosts {
  Problem problem;
  MixedVariables v = add_mixed_variables(problem);
  MixedCosts() {
    each_mixed_cost(v, [&](const auto& residual, const Gaussian& noise, const auto& x, const Loss& loss) {
      problem.minimize(residual, noise, x, loss);
    });
  }
  Comparison compared() {
    return compare(problem, std::vector{v.a, v.b, v.c}, std::vector{v.p}, std::vector{v.q}, std::vector{v.s});
  }
};

TEST(Marginals, MatchTheDenseMethodForMixedGroupsAndRobustLosses) {
  MixedCosts mixed;
  const Comparison c = mixed.compared();
  EXPECT_LE(c.error, kTolerance);
  EXPECT_EQ(c.pairs, 36);
  EXPECT_GT(c.outside, 0);
}

TEST(Marginals, AreZeroForFixedVariables) {
  MixedCosts mixed;
  mixed.problem.fix(mixed.v.b);
  mixed.problem.fix(mixed.v.q);
  EXPECT_LE(mixed.compared().error, kTolerance);
  const Marginals marginals(mixed.problem);
  EXPECT_TRUE(marginals.covariance(mixed.v.b).isZero(0.0));
  EXPECT_TRUE(marginals.cross_covariance(mixed.v.a, mixed.v.q).isZero(0.0));
  const Matrix<12, 12> joint = marginals.joint(mixed.v.b, mixed.v.a);
  EXPECT_TRUE((joint.bottomRightCorner<6, 6>() == marginals.covariance(mixed.v.a)));
  EXPECT_TRUE((joint.topRows<6>().isZero(0.0)));
}

TEST(Marginals, JointConsistsOfTheBlocks) {
  MixedCosts mixed;
  const Marginals marginals(mixed.problem);
  const auto& v = mixed.v;
  const Matrix<9, 9> joint = marginals.joint(v.p, v.a);  // outside the pattern
  EXPECT_TRUE((joint.topLeftCorner<3, 3>() == marginals.covariance(v.p)));
  EXPECT_TRUE((joint.topRightCorner<3, 6>() == marginals.cross_covariance(v.p, v.a)));
  EXPECT_TRUE((joint.bottomLeftCorner<6, 3>().isApprox(marginals.cross_covariance(v.a, v.p), 1e-12)));
  EXPECT_TRUE((joint.bottomRightCorner<6, 6>() == marginals.covariance(v.a)));
  EXPECT_GT((joint.llt().matrixLLT().diagonal().minCoeff()), 0.0);
}

TEST(Marginals, MatchTheDenseMethodForATrackingProblem) {
  Simulation simulation;
  simulation.duration = 12.0;
  simulation.noise = 1.0;
  TrackingProblem tracking = make_tracking_problem(simulation.data());
  ASSERT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
  const Comparison c = compare(tracking.problem, poses(tracking.chaser), poses(tracking.target));
  EXPECT_LE(c.error, 1e-9);  // limited by the condition of H: standard deviations range from 1e-2 to 10
  EXPECT_GT(c.outside, 0);
  const Marginals marginals(tracking.problem);
  for (std::size_t k = 1; k < tracking.chaser.size(); ++k)  // the first keyframe has no measurement
    EXPECT_TRUE(marginals.in_pattern(pose(tracking.chaser[k]), pose(tracking.target[k]))) << k;
}

/// Two parallel chains, connected only at their ends: pairs across, with and without being named.
TEST(Marginals, StoreNamedPairs) {
  constexpr int n = 40;
  PoseGraph graph(2 * n, {{0, n}, {n - 1, 2 * n - 1}});
  std::vector<Marginals::Pair> pairs;
  for (int k = 0; k < n; ++k)
    pairs.emplace_back(graph.problem.id(graph.x[std::size_t(n + k)]), graph.problem.id(graph.x[std::size_t(k)]));
  const Marginals plain(graph.problem), named(graph.problem, pairs);
  int outside = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const auto &a = graph.x[k], &b = graph.x[n + k];
    outside += !plain.in_pattern(a, b);
    EXPECT_TRUE(named.in_pattern(a, b)) << k;
    EXPECT_TRUE((named.joint(a, b).isApprox(plain.joint(a, b), kTolerance))) << k;
  }
  EXPECT_GT(outside, n / 2) << "most pairs must be outside the pattern";
  EXPECT_THROW(Marginals(graph.problem, std::vector<Marginals::Pair>{{0, 1000}}), Error);
}

TEST(Marginals, AllowNamedPairsWithFixedVariables) {
  PoseGraph graph(12, {});
  graph.problem.fix(graph.x[3]);
  const std::vector<Marginals::Pair> pairs{{graph.problem.id(graph.x[3]), graph.problem.id(graph.x[9])},
                                           {graph.problem.id(graph.x[8]), graph.problem.id(graph.x[5])}};
  const Marginals marginals(graph.problem, pairs);
  EXPECT_TRUE(marginals.cross_covariance(graph.x[3], graph.x[9]).isZero(0.0));
  EXPECT_TRUE(marginals.in_pattern(graph.x[5], graph.x[8]));
}

TEST(Marginals, StopOnRequest) {
  PoseGraph graph(12, {});
  std::atomic<bool> flag = true;
  SolverOptions options;
  options.stop = &flag;
  EXPECT_THROW(Marginals(graph.problem, {}, Stop(options)), Stopped);
  options.stop = nullptr;
  options.time_limit = 0;
  EXPECT_THROW(Marginals(graph.problem, {}, Stop(options)), Stopped);
}

TEST(Marginals, AreASnapshot) {
  PoseGraph graph(4, {});
  const Marginals marginals(graph.problem);
  const Matrix<6, 6> before = marginals.covariance(graph.x[2]);
  const auto late = graph.problem.add(SE3(), "late");
  graph.problem.minimize(Prior<SE3>{SE3()}, Gaussian(wave(0.5).cwiseAbs()), {graph.x[2]});
  graph.problem.minimize(Prior<SE3>{SE3()}, Gaussian(wave(0.5).cwiseAbs()), {late});
  EXPECT_TRUE(marginals.covariance(graph.x[2]) == before);
  EXPECT_THROW(marginals.covariance(late), Error);
  EXPECT_THROW(marginals.covariance(Variable<SE3>()), Error);
  EXPECT_LT(Marginals(graph.problem).covariance(graph.x[2]).trace(), before.trace());
}

std::string message_of(Problem& problem) {
  try {
    const Marginals marginals(problem);
  } catch (const Error& e) {
    return e.what();
  }
  return {};
}

TEST(Marginals, NameUnobservableDirections) {
  Problem problem;
  const auto q = problem.add(SE2(), "boat"), w = problem.add(SE2::Exp({1, 2, 0.3}), "buoy");
  problem.minimize(Prior<SE2>{SE2()}, Gaussian{0.1, 0.1, 0.1}, {q});
  problem.minimize(UsblPosition<SE2>{Vector<2>(1, 2)}, Gaussian{0.1, 0.1}, {q, w});
  const Marginals marginals(problem);
  EXPECT_THAT(describe(marginals.unobservable()), ::testing::HasSubstr("buoy in heading"));
  const Matrix<3, 3> S = marginals.covariance(w);
  EXPECT_EQ(S(2, 2), HUGE_VAL);
  EXPECT_EQ(S(0, 2), 0);
  EXPECT_TRUE((S.topLeftCorner<2, 2>().allFinite()));
  EXPECT_TRUE(marginals.cross_covariance(q, w).allFinite());
  EXPECT_EQ(marginals.log_determinant(), -HUGE_VAL);
  try {
    marginals.require_regular();
    FAIL() << "the Hessian is singular";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("unobservable: buoy in heading"));
  }
}

/// Inequalities are ignored, so a direction that only a bound restricts is unobservable.
TEST(Marginals, IgnoreInequalities) {
  Problem problem;
  const auto x = problem.add(R3({0, 0, 0}), "x"), y = problem.add(R3({0, 0, 0}), "y");
  problem.minimize(Prior<R3>{R3()}, Gaussian{1, 1, 1}, {x});
  problem.subject_to(Prior<R3>{R3()}, at_least(0.0), {y});
  EXPECT_THAT(describe(Marginals(problem).unobservable()), ::testing::HasSubstr("y in x, y, z"));
  problem.minimize(Prior<R3>{R3()}, Gaussian{1, 2, 3}, {y});
  EXPECT_NEAR(Marginals(problem).covariance(y)(2, 2), 9.0, 1e-12);
}

TEST(Marginals, RejectValuesThatAreNotFinite) {
  MixedCosts mixed;
  mixed.problem.set_value(mixed.v.p, R3({NAN, 0, 0}));
  EXPECT_THAT(message_of(mixed.problem), ::testing::HasSubstr("not finite"));
}

}  // namespace
}  // namespace tandem::testing
