#include <random>

#include <Eigen/Dense>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/bundle.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/problem/marginal_prior.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/residuals/usbl_position.hpp>

#include "allocation_count.hpp"

namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

Gaussian noise(int n, double sigma) { return Gaussian(Eigen::VectorXd::Constant(n, sigma)); }

SE3 random_pose(std::mt19937_64& random, double size) {
  std::uniform_real_distribution<double> entry(-size, size);
  Vector<6> v;
  for (auto& x : v) x = entry(random);
  return SE3::Exp(v);
}

/// Cost, gradient and dense Hessian with respect to perturbations of the point.
struct Model {
  double cost;
  Eigen::VectorXd g;
  Eigen::MatrixXd H;
};
Model model_of(NlpEvaluator& nlp) {
  const SymmetricPattern& pattern = nlp.hessian_pattern();
  Model m{0, Eigen::VectorXd(pattern.size()), Eigen::MatrixXd::Zero(pattern.size(), pattern.size())};
  const std::vector<int> start = pattern.column_starts(), row = pattern.rows();
  Eigen::VectorXd values(pattern.nonzeros());
  m.cost = nlp.linearize(m.g, values);
  for (int j = 0; j < pattern.size(); ++j)
    for (int k = start[std::size_t(j)]; k < start[std::size_t(j) + 1]; ++k)
      m.H(row[std::size_t(k)], j) = m.H(j, row[std::size_t(k)]) = values[k];
  return m;
}
Model model_of(Problem& problem) {
  NlpEvaluator nlp(problem);
  return model_of(nlp);
}

/// Returns the model minimised over its first unknowns, by dense algebra.
Model schur(const Model& m, Eigen::Index first) {
  const Eigen::Index rest = m.g.size() - first;
  const auto pivot = m.H.topLeftCorner(first, first).completeOrthogonalDecomposition();
  const Eigen::MatrixXd by = pivot.solve(m.H.topRightCorner(first, rest));
  const Eigen::VectorXd g = m.g.head(first);
  return {m.cost - 0.5 * g.dot(Eigen::VectorXd(pivot.solve(g))), m.g.tail(rest) - by.transpose() * g,
          m.H.bottomRightCorner(rest, rest) - m.H.bottomLeftCorner(rest, first) * by};
}

void expect_equal(const Model& a, const Model& b, double tolerance) {
  EXPECT_NEAR(a.cost, b.cost, tolerance * (1 + std::abs(b.cost)));
  ASSERT_EQ(a.g.size(), b.g.size());
  EXPECT_LE((a.g - b.g).norm(), tolerance * (1 + b.g.norm()));
  EXPECT_LE((a.H - b.H).norm(), tolerance * b.H.norm());
}

/// Chain of poses with odometry and constant-twist residuals.
struct Chain {
  Problem problem;
  std::vector<Variable<SE3>> x;
  std::vector<Block> odometry;
  std::mt19937_64 random{3};

  explicit Chain(bool anchored = true, int n = 4) {
    for (int k = 0; k < n; ++k) x.push_back(problem.add(random_pose(random, 0.8), "x" + std::to_string(k)));
    if (anchored) problem.minimize(Prior<SE3>{random_pose(random, 0.8)}, noise(6, 0.5), {x[0]});
    for (int k = 0; k + 1 < n; ++k)
      odometry.push_back(problem.minimize(RelativePose<SE3>{random_pose(random, 0.5)}, noise(6, 0.1),
                                          {x[std::size_t(k)], x[std::size_t(k) + 1]}));
    for (int k = 0; k + 2 < n; ++k)
      problem.minimize(ConstantTwist<SE3>{1.0, 0.5}, noise(6, 0.3),
                       {x[std::size_t(k)], x[std::size_t(k) + 1], x[std::size_t(k) + 2]});
  }
};

TEST(Marginalize, PriorIsTheSchurComplement) {
  Chain chain;
  auto& x = chain.x;
  chain.problem.minimize(UsblPosition<SE3>{{1.0, 2.0, 3.0}}, noise(3, 0.2), {x[0], x[2]}, Cauchy(1.0));
  chain.problem.minimize(UsblPosition<SE3>{{-1.0, 2.0, 1.0}}, noise(3, 0.2), {x[1], x[3]}, Huber(0.5));
  const Model whole = model_of(chain.problem);
  chain.problem.marginalize(x[0], x[1]);
  EXPECT_EQ(chain.problem.num_variables(), 2);
  EXPECT_EQ(chain.problem.num_soft_blocks(), 2);  // the prior, and the odometry from x2 to x3
  EXPECT_FALSE(chain.problem.has(x[0]));
  EXPECT_TRUE(chain.problem.has(x[3]));
  expect_equal(model_of(chain.problem), schur(whole, 12), 1e-11);
}

TEST(Marginalize, MergesPriorByItsExactDerivatives) {
  Chain chain;
  auto& x = chain.x;
  chain.problem.marginalize(x[0]);
  for (int k = 1; k < 4; ++k)  // far from where the prior was linearised
    chain.problem.set_value(x[std::size_t(k)], chain.problem.value(x[std::size_t(k)]) * random_pose(chain.random, 0.7));
  const Model whole = model_of(chain.problem);
  chain.problem.marginalize(x[1]);
  EXPECT_EQ(chain.problem.num_soft_blocks(), 2);
  expect_equal(model_of(chain.problem), schur(whole, 6), 1e-11);
}

TEST(Marginalize, MergesPriorOnUnrelatedVariables) {
  Problem problem;
  const auto a = problem.add(R3({1, 2, 3})), b = problem.add(R3({0, 1, 0})), c = problem.add(R3({2, 2, 2})),
             d = problem.add(R3({3, 0, 1}));
  for (const auto& [from, to] : {std::pair(a, b), std::pair(c, d)}) {
    problem.minimize(Prior<R3>{R3({0.5, 0.5, 0.5})}, noise(3, 1.0), {from});
    problem.minimize(RelativePose<R3>{R3({1, 0, 0})}, noise(3, 0.5), {from, to});
  }
  problem.marginalize(a);
  const double cost = NlpEvaluator(problem).cost();
  problem.marginalize(c);
  EXPECT_EQ(problem.num_soft_blocks(), 1);
  const Model m = model_of(problem);
  EXPECT_LE(m.cost, cost);
  EXPECT_NEAR(m.H(0, 0), 1 / 1.25, 1e-12);
  EXPECT_NEAR(m.H(3, 3), 1 / 1.25, 1e-12);
  EXPECT_EQ(m.H.topRightCorner(3, 3).norm(), 0.0);
}

TEST(Marginalize, OrderDoesNotMatterAtOnePoint) {
  Chain at_once, one_by_one;
  at_once.problem.marginalize(at_once.x[0], at_once.x[1]);
  one_by_one.problem.marginalize(one_by_one.x[1]);
  one_by_one.problem.marginalize(one_by_one.x[0]);
  expect_equal(model_of(one_by_one.problem), model_of(at_once.problem), 1e-11);
}

TEST(Marginalize, UnobservableDirectionsLeaveNoInformation) {
  Chain chain(false);  // without a prior the whole chain can move rigidly
  const Model whole = model_of(chain.problem);
  chain.problem.marginalize(chain.x[0], chain.x[1]);
  const Model left = model_of(chain.problem);
  expect_equal(left, schur(whole, 12), 1e-10);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(left.H);
  EXPECT_LE(eigen.eigenvalues().head(6).cwiseAbs().maxCoeff(), 1e-10 * eigen.eigenvalues()[11]);
  EXPECT_GE(eigen.eigenvalues()[6], 1e-3);

  // Variables that the residuals observe partly or not at all.
  Problem problem;
  const auto c = problem.add(SE3()), t = problem.add(SE3(SO3(), Vector<3>(1, 2, 3))), lonely = problem.add(SE3());
  problem.minimize(Prior<SE3>{SE3()}, noise(6, 1.0), {c});
  problem.minimize(UsblPosition<SE3>{{1.0, 2.1, 3.0}}, noise(3, 0.5), {c, t});
  problem.marginalize(t, lonely);
  EXPECT_EQ(problem.num_variables(), 1);
  const Model m = model_of(problem);
  EXPECT_LE((m.H - Eigen::MatrixXd::Identity(6, 6)).norm(), 1e-12);  // the fix has no information on the chaser
  EXPECT_NEAR(m.cost, 0.0, 1e-12);
}

TEST(Marginalize, FixedVariablesAreConstants) {
  Chain chain;
  chain.problem.fix(chain.x[2]);
  const Model whole = model_of(chain.problem);
  chain.problem.marginalize(chain.x[0]);
  EXPECT_TRUE(chain.problem.has(chain.x[2]));
  expect_equal(model_of(chain.problem), schur(whole, 6), 1e-11);
  chain.problem.marginalize(chain.x[2]);  // fixed itself; its blocks are absorbed
  EXPECT_FALSE(chain.problem.has(chain.x[2]));
  expect_equal(model_of(chain.problem), schur(whole, 6), 1e-11);
}

/// Chain in which the marginal prior is the only block of the two middle poses.
struct PriorAlone : Chain {
  PriorAlone() {
    problem.remove(odometry[1]);
    problem.marginalize(x[0], x[3]);
  }
};

TEST(Marginalize, PriorDerivativesAreExactFarFromTheAnchor) {
  PriorAlone other;
  ASSERT_EQ(other.problem.num_soft_blocks(), 1);
  NlpEvaluator nlp(other.problem);
  const int n = nlp.num_unknowns();
  Eigen::VectorXd delta(n), g(n), ahead(n), behind(n);
  for (int i = 0; i < n; ++i) delta[i] = 1.1 * std::sin(1.0 + 3.0 * i);
  nlp.move_to(delta);
  nlp.gradient(g);
  Eigen::VectorXd exact(nlp.hessian_pattern().nonzeros());
  nlp.exact_hessian(1.0, {}, exact);
  Eigen::VectorXd first_order(exact.size()), curvature(exact.size());
  nlp.linearize(ahead, first_order);
  nlp.curvature({}, curvature);
  // Differences with h = 1e-5 have a rounding error of 1e-16 / h.
  EXPECT_LE((first_order + curvature - exact).cwiseAbs().maxCoeff(), 1e-10 * exact.cwiseAbs().maxCoeff());
  for (int i = 0; i < n; ++i) {
    constexpr double h = 1e-5;
    Eigen::VectorXd moved = delta;
    moved[i] += h;
    nlp.move_to(moved);
    const double up = nlp.gradient(ahead);
    moved[i] -= 2 * h;
    nlp.move_to(moved);
    const double down = nlp.gradient(behind);
    EXPECT_NEAR(g[i], (up - down) / (2 * h), 1e-6 * (1 + g.norm())) << i;
    const Eigen::VectorXd column = (ahead - behind) / (2 * h);
    const auto& pattern = nlp.hessian_pattern();
    const std::vector<int> start = pattern.column_starts(), row = pattern.rows();
    for (int k = start[std::size_t(i)]; k < start[std::size_t(i) + 1]; ++k)
      EXPECT_NEAR(exact[k], column[row[std::size_t(k)]], 1e-5 * column.norm());
  }
}

TEST(Marginalize, PriorHessianIsThatOfItsResidual) {
  PriorAlone chain;
  for (const int k : {1, 2})
    chain.problem.set_value(chain.x[std::size_t(k)],
                            chain.problem.value(chain.x[std::size_t(k)]) * random_pose(chain.random, 0.9));
  const Model m = model_of(chain.problem);
  // Expected model: a quadratic of x = X ⊖ X̄ with gradient g₀ and Hessian H₀ at x = 0. Thus H = Jᵀ H₀ J and g = Jᵀ (g₀
  // + H₀ x).
  PriorAlone same;
  const Model at_anchor = model_of(same.problem);
  Eigen::VectorXd x(12);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(12, 12);
  for (int k = 0; k < 2; ++k) {
    const auto& v = chain.x[std::size_t(k) + 1];
    const Vector<6> d = minus(chain.problem.value(v), same.problem.value(same.x[std::size_t(k) + 1]));
    x.segment<6>(6 * k) = d;
    J.block<6, 6>(6 * k, 6 * k) = SE3::Jr_inverse(d);
  }
  const Model expected{at_anchor.cost + at_anchor.g.dot(x) + 0.5 * x.dot(at_anchor.H * x),
                       J.transpose() * (at_anchor.g + at_anchor.H * x), J.transpose() * at_anchor.H * J};
  expect_equal(m, expected, 1e-11);
  NlpEvaluator nlp(chain.problem);
  Eigen::VectorXd v(12);
  for (int i = 0; i < 12; ++i) v[i] = std::cos(2.0 * i);
  const auto stiffness = nlp.stiffness(v, {});
  EXPECT_NEAR(stiffness.along, v.dot(m.H * v), 1e-9 * stiffness.along);
  EXPECT_NEAR(stiffness.scale, v.cwiseAbs2().dot(m.H.diagonal()), 1e-9 * stiffness.scale);
}

TEST(Marginalize, InactiveInequalitiesLeaveWithoutTrace) {
  Chain free, bounded;
  bounded.problem.subject_to(TwistComponents<SE3, surge>{1.0}, at_least(0.0), {bounded.x[0], bounded.x[1]});
  free.problem.marginalize(free.x[0]);
  bounded.problem.marginalize(bounded.x[0]);
  EXPECT_EQ(bounded.problem.num_hard_blocks(), 0);
  expect_equal(model_of(bounded.problem), model_of(free.problem), 1e-14);
}

TEST(Marginalize, AWholePartCanLeaveUnderEqualities) {
  for (const bool determined : {true, false}) {
    Problem problem;
    const auto x = problem.add(R3());
    const auto y = problem.add(R3(Vector<3>(1, 0, 0)));
    problem.minimize(Prior<R3>{R3()}, noise(3, 1.0), {problem.add(R3())});  // not connected, stays
    problem.minimize(Prior<R3>{R3(Vector<3>(2, 0, 0))}, noise(3, 1.0), {x});
    if (determined) problem.subject_to(Prior<R3>{R3()}, equal_to(0), {x});
    problem.subject_to(RelativePose<R3>{R3(Vector<3>(1, 0, 0))}, equal_to(0), {x, y});
    problem.marginalize(x, y);
    EXPECT_EQ(problem.num_variables(), 1) << determined;
    EXPECT_EQ(problem.num_hard_blocks(), 0) << determined;
    EXPECT_NEAR(NlpEvaluator(problem).cost(), determined ? 2.0 : 0.0, 1e-12);
  }
}

TEST(Marginalize, RejectsInvalidCallsWithoutChanges) {
  Chain chain;
  auto& problem = chain.problem;
  auto& x = chain.x;
  EXPECT_THROW(problem.marginalize(x[0], x[0]), Error);
  EXPECT_THROW(problem.marginalize(std::vector<int>{99}), Error);
  problem.minimize(Prior<SE3>{SE3(SO3(), Vector<3>(HUGE_VAL, 0, 0))}, noise(6, 1.0), {x[0]});
  EXPECT_THAT([&] { problem.marginalize(x[0]); }, ThrowsMessage<Error>(HasSubstr("not finite")));
  EXPECT_EQ(problem.num_variables(), 4);
  Chain other;
  other.problem.marginalize(other.x[0]);
  EXPECT_THAT([&] { other.problem.marginalize(other.x[0]); }, ThrowsMessage<Error>(HasSubstr("has been removed")));
}

TEST(Marginalize, PriorIsAnOrdinaryBlock) {
  Chain chain;
  EXPECT_FALSE(chain.problem.marginal_prior());
  chain.problem.marginalize(chain.x[0]);
  ASSERT_TRUE(chain.problem.marginal_prior());
  EXPECT_EQ(chain.problem.weight(*chain.problem.marginal_prior()), 1.0);
  EXPECT_THAT([&] { chain.problem.remove(chain.x[1]); }, ThrowsMessage<Error>(HasSubstr("still read by a block")));
  chain.problem.remove(*chain.problem.marginal_prior());
  EXPECT_FALSE(chain.problem.marginal_prior());
  chain.problem.marginalize(chain.x[1]);
  EXPECT_TRUE(chain.problem.marginal_prior());
}

TEST(Marginalize, PriorWithoutVariablesKeepsTheCost) {
  Problem problem;
  const auto x = problem.add(R3({1, 2, 3})), y = problem.add(R3());
  problem.minimize(Prior<R3>{R3()}, noise(3, 1.0), {x});
  problem.minimize(Prior<R3>{R3({1, 0, 0})}, noise(3, 1.0), {x});
  problem.minimize(Prior<R3>{R3()}, noise(3, 1.0), {y});
  problem.marginalize(x);
  EXPECT_NEAR(NlpEvaluator(problem).cost(), 0.25, 1e-12);
  EXPECT_EQ(problem.num_variables(), 1);
}

TEST(Marginalize, EvaluatingThePriorDoesNotAllocate) {
  using State = Bundle<SE3, Rn<9>>;  // larger than the fixed-size kernels
  Chain chain;
  const auto wide = chain.problem.add(State()), gone = chain.problem.add(State());
  chain.problem.minimize(RelativePose<State>{State()}, noise(15, 1.0), {wide, gone});
  chain.problem.marginalize(chain.x[0], gone);
  NlpEvaluator nlp(chain.problem);
  const int n = nlp.num_unknowns();
  const Eigen::VectorXd delta = Eigen::VectorXd::Constant(n, 0.1), none;
  Eigen::VectorXd g(n), H(nlp.hessian_pattern().nonzeros());
  double sum = 0;
  const auto evaluate = [&] {
    nlp.move_to(delta);
    sum += nlp.cost() + nlp.gradient(g) + nlp.linearize(g, H) + nlp.linearize_at_point(g, H);
    sum += nlp.stiffness(delta, none).along;
    nlp.exact_hessian(1.0, none, H);
    nlp.reset();
  };
  evaluate();
  const long before = allocations;
  evaluate();
  EXPECT_EQ(allocations - before, 0);
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace
}  // namespace tandem::testing
