#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mixed_problem.hpp"

/// Weights of robust blocks, and losses with widened scales.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::vector<Loss> robust(double scale) { return {Huber(scale), Cauchy(scale), GemanMcClure(scale), Tukey(scale)}; }

/// The mixed problem with every loss's scale multiplied by a factor when it is made.
struct Scaled {
  Problem problem;
  MixedVariables v = add_mixed_variables(problem);

  explicit Scaled(double factor) {
    each_mixed_cost(v, [&](const auto& residual, const Gaussian& noise, const auto& x, Loss loss) {
      loss.scale *= factor;
      problem.minimize(residual, noise, x, loss);
    });
  }
};

struct Evaluated {
  double cost;
  Eigen::VectorXd gradient, hessian, exact;
};
Evaluated evaluate(Problem& problem) {
  Program program(problem);
  const int n = program.num_unknowns();
  Evaluated e{0, Eigen::VectorXd(n), hessian_values(program), hessian_values(program)};
  program.move_to(random_vector(n, 0.5, 3));
  e.cost = program.linearize(e.gradient, e.hessian);
  program.exact_hessian(1.0, {}, e.exact);
  program.reset();
  return e;
}
void expect_identical(const Evaluated& a, const Evaluated& b) {
  EXPECT_EQ(a.cost, b.cost);
  EXPECT_EQ(a.gradient, b.gradient);
  EXPECT_EQ(a.hessian, b.hessian);
  EXPECT_EQ(a.exact, b.exact);
}

TEST(Widening, IsAsIfTheScalesWereGivenSo) {
  Scaled original(1.0);
  const Evaluated before = evaluate(original.problem);
  for (const double factor : {0.5, 3.0, 1e4}) {
    Scaled made(factor);
    original.problem.widen_losses(factor);
    EXPECT_EQ(original.problem.widening(), factor);
    const Evaluated widened = evaluate(original.problem);
    expect_identical(widened, evaluate(made.problem));
    EXPECT_NE(widened.cost, before.cost);
  }
  original.problem.widen_losses(1.0);
  expect_identical(evaluate(original.problem), before);
}

TEST(Widening, HoldsForBlocksToComeAndMovesAlong) {
  Problem problem;
  const auto x = problem.add(R3({3.0, 0.0, 0.0}));
  const Block first = problem.minimize(Prior<R3>{R3()}, kUnit3, {x}, Cauchy(1.0));
  problem.widen_losses(3.0);
  const Block same_pool = problem.minimize(Prior<R3>{R3()}, kUnit3, {x}, Cauchy(1.0));
  Problem moved = std::move(problem);
  const auto chaser = moved.add(SE3());
  const Block other_pool = moved.minimize(UsblPosition<SE3, R3>{Vector<3>::Zero()}, kUnit3, {chaser, x}, Cauchy(1.0));
  for (const Block& block : {first, same_pool, other_pool}) EXPECT_DOUBLE_EQ(moved.weight(block), 0.5);
  moved.widen_losses(1.0);
  for (const Block& block : {first, same_pool, other_pool}) EXPECT_DOUBLE_EQ(moved.weight(block), 0.1);
}

TEST(Widening, RefusesWhatIsNotPositiveAndFinite) {
  Problem problem;
  for (const double bad : {0.0, -1.0, HUGE_VAL, std::nan("")})
    EXPECT_THAT([&] { problem.widen_losses(bad); }, ThrowsMessage<Error>(HasSubstr("not positive and finite"))) << bad;
  EXPECT_EQ(problem.widening(), 1.0);
}

TEST(Weight, IsTheSlopeOfTheLoss) {
  Problem problem;
  const auto x = problem.add(R3({2.0, -1.0, 0.0}));
  const Gaussian noise{0.5, 1.0, 1.0};
  const double s = 17.0;
  EXPECT_EQ(problem.weight(problem.minimize(Prior<R3>{R3()}, noise, {x})), 1.0);
  for (const Loss& loss : robust(3.0)) {
    const Block block = problem.minimize(Prior<R3>{R3()}, noise, {x}, loss);
    EXPECT_DOUBLE_EQ(problem.weight(block), loss(s).d1);
    EXPECT_LT(problem.weight(block), 0.8);
  }
}

TEST(Weight, FollowsTheBlockWhenOthersAreRemovedAndItsVariable) {
  Problem problem;
  const auto x = problem.add(R3({1.0, 0.0, 0.0}));
  std::vector<Block> blocks;
  for (const double scale : {1.0, 2.0, 3.0})
    blocks.push_back(problem.minimize(Prior<R3>{R3()}, kUnit3, {x}, Cauchy(scale)));
  problem.remove(blocks[0]);
  EXPECT_DOUBLE_EQ(problem.weight(blocks[1]), 4.0 / 5.0);
  EXPECT_DOUBLE_EQ(problem.weight(blocks[2]), 9.0 / 10.0);
  problem.set_value(x, R3({0.0, 2.0, 0.0}));
  EXPECT_DOUBLE_EQ(problem.weight(blocks[1]), 0.5);
}

TEST(Weight, IsForSoftBlocksThatAreThere) {
  Problem problem;
  const auto x = problem.add(R3());
  const Block hard = problem.subject_to(Prior<R3>{R3()}, equal_to(0), {x});
  const Block soft = problem.minimize(Prior<R3>{R3()}, kUnit3, {x});
  problem.remove(soft);
  EXPECT_THAT([&] { problem.weight(hard); }, ThrowsMessage<Error>(HasSubstr("prior is a hard block")));
  EXPECT_THAT([&] { problem.weight(soft); }, ThrowsMessage<Error>(HasSubstr("no such block")));
  EXPECT_THROW(problem.weight(Block{}), Error);
}

/// d²/dr² of ½ ρ(r²) is ρ' + 2 s ρ''.
TEST(ConvexWidening, IsWhereTheLossEndsToBeConvex) {
  for (const Loss& loss : robust(1.7)) {
    const double end = loss.convex_until() * loss.scale * loss.scale;
    const auto curvature = [&](double s) { return loss(s).d1 + 2.0 * s * loss(s).d2; };
    for (double s = 0; s < 0.999 * end; s += 0.1 * end) EXPECT_GT(curvature(s), 0.0);
    EXPECT_LE(curvature(1.001 * end), 0.0);
  }
  EXPECT_EQ(Loss{}.convex_until(), HUGE_VAL);
}

TEST(ConvexWidening, IsTheLargestThatABlockNeeds) {
  Problem problem;
  const auto x = problem.add(R3({6.0, 0.0, 0.0}));
  problem.minimize(Prior<R3>{R3()}, kUnit3, {x});
  EXPECT_EQ(problem.convex_widening(), std::nullopt) << "nothing is robust";
  problem.minimize(Prior<R3>{R3()}, kUnit3, {x}, Cauchy(2.0));
  EXPECT_DOUBLE_EQ(problem.convex_widening().value(), 3.0);
  problem.minimize(Prior<R3>{R3()}, Gaussian{2.0, 2.0, 2.0}, {x}, GemanMcClure(0.5));
  EXPECT_DOUBLE_EQ(problem.convex_widening().value(), 6.0 * std::sqrt(3.0));
  problem.widen_losses(100.0);
  EXPECT_DOUBLE_EQ(problem.convex_widening().value(), 6.0 * std::sqrt(3.0)) << "whatever the widening now";
  problem.set_value(x, R3());
  EXPECT_EQ(problem.convex_widening(), 0.0);
}

}  // namespace
}  // namespace tandem::testing
