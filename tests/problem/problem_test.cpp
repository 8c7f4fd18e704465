#include <algorithm>
#include <map>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mixed_problem.hpp"

namespace tandem::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using ::testing::UnorderedElementsAre;

const Gaussian kUnit6{1.0, 1.0, 1.0, 1.0, 1.0, 1.0};

SE3 pose(double x) { return SE3::Exp((Vector<6>() << x, 0.5, -x, 0.1 * x, -0.2, 0.3).finished()); }

TEST(Problem, VariablesAreTyped) {
  Problem problem;
  const Variable<SE3> x = problem.add(pose(1.0), "x");
  const Variable<R3> p = problem.add(R3({1.0, 2.0, 3.0}));
  const Variable<SE3> y = problem.add(pose(2.0));
  EXPECT_EQ(problem.num_variables(), 3);
  EXPECT_EQ(problem.id(x), 0);
  EXPECT_EQ(problem.id(p), 1);
  EXPECT_EQ(problem.id(y), 2);
  EXPECT_EQ(problem.name(0), "x");
  EXPECT_EQ(problem.name(1), "variable 1");
  EXPECT_TRUE(problem.value(x).matrix() == pose(1.0).matrix());
  EXPECT_TRUE(problem.value(y).matrix() == pose(2.0).matrix());
  EXPECT_EQ(problem.value(p).vector(), Vector<3>(1.0, 2.0, 3.0));
}

TEST(Problem, CountsBlocksUnknownsAndRows) {
  Problem problem;
  const auto x0 = problem.add(pose(0.0)), x1 = problem.add(pose(1.0)), x2 = problem.add(pose(2.0));
  problem.minimize(ConstantTwist<SE3>{1.0, 1.0}, kUnit6, {x0, x1, x2});
  problem.minimize(UsblPosition<SE3>{{1.0, 2.0, 3.0}}, kUnit3, {x0, x1}, Cauchy(1.0));
  problem.minimize(Prior<SE3>{SE3()}, kUnit6, {x0});
  problem.subject_to(TwistComponents<SE3, sway | heave>{1.0}, equal_to(0), {x0, x1});
  problem.subject_to(TwistComponents<SE3, surge>{1.0}, between(0.0, 2.5), {x0, x1});
  problem.subject_to(TwistComponents<SE3, surge>{1.0}, at_least(0.0), {x1, x2});
  problem.subject_to(TwistComponents<SE3, yaw_rate>{1.0}, at_most(0.1), {x1, x2});
  EXPECT_EQ(problem.num_soft_blocks(), 3);
  EXPECT_EQ(problem.num_hard_blocks(), 4);
  EXPECT_EQ(problem.size().unknowns, 18);
  EXPECT_EQ(problem.size().equalities, 2);
  EXPECT_EQ(problem.size().inequalities, 3);
  const NlpEvaluator nlp(problem);
  EXPECT_EQ(nlp.lower(), (Eigen::VectorXd(5) << 0, 0, 0, 0, -HUGE_VAL).finished());
  EXPECT_EQ(nlp.upper(), (Eigen::VectorXd(5) << 0, 0, 2.5, HUGE_VAL, 0.1).finished());
}

TEST(Problem, RejectsCrossedBounds) {
  Problem problem;
  const auto x = problem.add(R3());
  EXPECT_THAT([&] { problem.subject_to(Prior<R3>{R3()}, between(2.0, 1.0), {x}); },
              ThrowsMessage<Error>(HasSubstr("prior: the lower bound 2.0")));
  EXPECT_THROW(problem.subject_to(Prior<R3>{R3()}, Bounds<3>{{0, 0, 1}, {1, 1, 0.5}}, {x}), Error);
  EXPECT_THROW(problem.subject_to(Prior<R3>{R3()}, equal_to(std::nan("")), {x}), Error);
  EXPECT_EQ(problem.num_hard_blocks(), 0);
}

TEST(Problem, RejectsNoiseOfWrongDimension) {
  Problem problem;
  const auto x = problem.add(SE3());
  EXPECT_THAT([&] { problem.minimize(Prior<SE3>{SE3()}, kUnit3, {x}); },
              ThrowsMessage<Error>(HasSubstr("the residual has 6 rows, but the noise has 3")));
  EXPECT_THROW(problem.minimize(Prior<SE3>{SE3()}, kUnit6, {x}, Loss{Loss::Kind::huber, 0.0}), Error);
  EXPECT_EQ(problem.num_soft_blocks(), 0);
}

TEST(Problem, RejectsVariablesOfAnotherProblem) {
  Problem problem, other;
  const auto mine = problem.add(SE3());
  const auto foreign = other.add(SE3());
  EXPECT_THROW(problem.minimize(Prior<SE3>{SE3()}, kUnit6, {foreign}), Error);
  EXPECT_THROW(problem.subject_to(RelativePose<SE3>{SE3()}, equal_to(0), {mine, foreign}), Error);
  EXPECT_THROW(problem.minimize(Prior<SE3>{SE3()}, kUnit6, {Variable<SE3>{}}), Error);
  EXPECT_THROW(problem.fix(foreign), Error);
  EXPECT_EQ(problem.num_soft_blocks() + problem.num_hard_blocks(), 0);
  EXPECT_EQ(NlpEvaluator(problem).num_unknowns(), 6);
}

TEST(Problem, FixesAndFreesVariables) {
  Problem problem;
  const auto x = problem.add(SE3(), "x");
  const auto p = problem.add(R3(), "p");
  problem.fix(x);
  EXPECT_EQ(problem.size().unknowns, 3);
  EXPECT_EQ(NlpEvaluator(problem).describe_unknown(0).variable, "p");
  problem.fix(x, false);
  problem.fix(p);
  EXPECT_EQ(problem.size().unknowns, 6);
  EXPECT_EQ(NlpEvaluator(problem).describe_unknown(0).variable, "x");
}

TEST(Problem, SetsValues) {
  Problem problem;
  const auto x = problem.add(R3());
  problem.minimize(Prior<R3>{R3({1.0, 0.0, 0.0})}, kUnit3, {x});
  EXPECT_EQ(NlpEvaluator(problem).cost(), 0.5);
  problem.set_value(x, R3({1.0, 3.0, 4.0}));
  EXPECT_EQ(problem.value(x).vector(), Vector<3>(1.0, 3.0, 4.0));
  EXPECT_EQ(NlpEvaluator(problem).cost(), 12.5);
}

TEST(Problem, MovingKeepsHandles) {
  Problem first;
  const auto x = first.add(pose(1.0), "x");
  const auto p = first.add(R3({1.0, 2.0, 3.0}), "p");
  const Block prior = first.minimize(Prior<SE3>{SE3()}, kUnit6, {x});
  first.subject_to(UsblPosition<SE3, R3>{{0.0, 0.0, 0.0}}, equal_to(0), {x, p});
  const double cost = NlpEvaluator(first).cost();

  Problem second = std::move(first);
  EXPECT_EQ(NlpEvaluator(second).cost(), cost);
  EXPECT_TRUE(second.value(x).matrix() == pose(1.0).matrix());
  second.minimize(Prior<R3>{R3()}, kUnit3, {p});
  second.set_value(p, R3());
  EXPECT_EQ(NlpEvaluator(second).cost(), cost);

  Problem third;
  third.add(SE2());
  third = std::move(second);
  EXPECT_EQ(third.num_variables(), 2);
  third.remove(prior);
  EXPECT_EQ(third.num_soft_blocks(), 1);
  EXPECT_EQ(NlpEvaluator(third).cost(), 0.0);
}

/// Problem with 10 variables to which up to 60 blocks of three types are added.
struct Many {
  Problem problem;
  std::vector<Variable<SE3>> x;

  Many() {
    for (int i = 0; i < 10; ++i) x.push_back(problem.add(pose(0.3 * i), "x" + std::to_string(i)));
  }
  Block add(int k) {
    const auto& from = x[std::size_t(k % 10)];
    const auto& to = x[std::size_t((3 * k + 1) % 10)];
    const Gaussian noise = kUnit6.scaled(1.0 + 0.1 * k);
    switch (k % 3) {
      case 0:
        return problem.minimize(RelativePose<SE3>{pose(0.1 * k)}, noise, {from, to}, Cauchy(1.0 + k));
      case 1:
        return problem.minimize(Prior<SE3>{pose(0.2 * k)}, noise, {from});
      default:
        return problem.subject_to(TwistComponents<SE3, surge>{1.0 + k}, between(-k, k), {from, to});
    }
  }
};

TEST(Problem, RemovingBlocksEqualsNeverAddingThem) {
  Many full;
  std::map<int, Block> present;
  for (int k = 0; k < 60; ++k) present[k] = full.add(k);
  std::vector<int> order(60);
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937(7));
  for (int i = 0; i < 45; ++i) {
    const int k = order[std::size_t(i)];
    full.problem.remove(present[k]);
    EXPECT_THROW(full.problem.remove(present[k]), Error);
    present.erase(k);
    if (i % 20 == 10) present[k] = full.add(k);  // added again, under a new handle
  }

  Many few;
  for (const auto& [k, block] : present) few.add(k);
  ASSERT_EQ(full.problem.num_soft_blocks(), few.problem.num_soft_blocks());
  ASSERT_EQ(full.problem.num_hard_blocks(), few.problem.num_hard_blocks());
  NlpEvaluator a(full.problem), b(few.problem);
  Eigen::VectorXd ga(60), gb(60), Ha = hessian_values(a), Hb = hessian_values(b);
  EXPECT_EQ(a.hessian_pattern().rows(), b.hessian_pattern().rows());
  EXPECT_NEAR(a.linearize(ga, Ha), b.linearize(gb, Hb), 1e-12);  // summed in a different order
  EXPECT_TRUE(ga.isApprox(gb, 1e-13));
  EXPECT_TRUE(Ha.isApprox(Hb, 1e-13));

  const auto rows = [](NlpEvaluator& nlp) {
    Eigen::VectorXd c(nlp.num_rows());
    nlp.constraints(c);
    std::vector<std::tuple<std::string, double, double, double>> result;
    for (int i = 0; i < nlp.num_rows(); ++i)
      result.emplace_back(nlp.describe_row(i), nlp.lower()[i], nlp.upper()[i], c[i]);
    std::sort(result.begin(), result.end());
    return result;
  };
  EXPECT_EQ(rows(a), rows(b));
}

TEST(Problem, RejectsRemovalOfUnknownBlocks) {
  Problem problem;
  const auto x = problem.add(SE3());
  const Block block = problem.minimize(Prior<SE3>{SE3()}, kUnit6, {x});
  EXPECT_THROW(problem.remove(Block{}), Error);
  EXPECT_THROW(problem.remove(Block{5, 0}), Error);
  EXPECT_THROW(problem.remove(Block{block.pool, 1}), Error);
  EXPECT_FALSE(problem.has(Block{}) || problem.has(Block{5, 0}) || problem.has(Block{block.pool, 1}));
  EXPECT_TRUE(problem.has(block));
  problem.remove(block);
  EXPECT_FALSE(problem.has(block));
  EXPECT_THROW(problem.remove(block), Error);
  EXPECT_EQ(problem.num_soft_blocks(), 0);
  EXPECT_EQ(NlpEvaluator(problem).cost(), 0.0);
}

TEST(Problem, ListsSoftBlocksOfAVariable) {
  Problem problem;
  const auto x = problem.add(SE3(), "x"), y = problem.add(SE3(), "y"), z = problem.add(SE3(), "z");
  const Block of_x = problem.minimize(Prior<SE3>{SE3()}, kUnit6, {x});
  const Block of_z = problem.minimize(Prior<SE3>{SE3()}, kUnit6, {z});
  const Block of_both = problem.minimize(RelativePose<SE3>{SE3()}, kUnit6, {y, z});
  problem.subject_to(RollPitch<SE3>{}, between(-0.2, 0.2), {x});
  const auto handle = [](const Block& block) { return std::pair(block.pool, block.id); };
  const auto reading = [&](const std::vector<int>& ids) {
    std::vector<std::pair<int, int>> handles;
    for (const Block& block : problem.soft_blocks_reading(ids)) handles.push_back(handle(block));
    return handles;
  };
  EXPECT_THAT(reading({problem.id(x)}), ElementsAre(handle(of_x)));
  EXPECT_THAT(reading({problem.id(y)}), ElementsAre(handle(of_both)));
  EXPECT_THAT(reading({problem.id(x), problem.id(z)}),
              UnorderedElementsAre(handle(of_x), handle(of_z), handle(of_both)));
  problem.remove(of_x);  // the last block of the pool takes its index
  EXPECT_THAT(reading({problem.id(z)}), UnorderedElementsAre(handle(of_z), handle(of_both)));
  problem.marginalize(std::vector{problem.id(y)});
  EXPECT_THAT(reading({problem.id(z)}), ElementsAre(handle(of_z))) << "without the marginal prior";
}

TEST(Problem, OneResidualServesBothRoles) {
  Problem problem;
  const auto x = problem.add(SE3(), "x");
  const RollPitch<SE3> level;
  problem.minimize(level, Gaussian{0.1, 0.1}, {x});
  problem.subject_to(level, between(-0.2, 0.2), {x});
  EXPECT_EQ(problem.num_soft_blocks(), 1);
  EXPECT_EQ(problem.num_hard_blocks(), 1);
}

}  // namespace
}  // namespace tandem::testing
