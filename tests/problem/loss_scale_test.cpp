#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mixed_problem.hpp"

/// Weights of robust blocks, Problem::scale_losses and Problem::convex_loss_scale.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::vector<Loss> robust(double scale) { return {Huber(scale), Cauchy(scale), GemanMcClure(scale), Tukey(scale)}; }

/// The mixed problem, built with the scale of every loss multiplied by a factor.
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
  NlpEvaluator nlp(problem);
  const int n = nlp.num_unknowns();
  Evaluated e{0, Eigen::VectorXd(n), hessian_values(nlp), hessian_values(nlp)};
  nlp.move_to(random_vector(n, 0.5, 3));
  e.cost = nlp.linearize(e.gradient, e.hessian);
  nlp.exact_hessian(1.0, {}, e.exact);
  nlp.reset();
  return e;
}
void expect_identical(const Evaluated& a, const Evaluated& b) {
  EXPECT_EQ(a.cost, b.cost);
  EXPECT_EQ(a.gradient, b.gradient);
  EXPECT_EQ(a.hessian, b.hessian);
  EXPECT_EQ(a.exact, b.exact);
}

TEST(ScaleLosses, EqualsBuildingWithScaledLosses) {
  Scaled original(1.0);
  const Evaluated before = evaluate(original.problem);
  for (const double factor : {0.5, 3.0, 1e4}) {
    Scaled made(factor);
    original.problem.scale_losses(factor);
    EXPECT_EQ(original.problem.loss_scale(), factor);
    const Evaluated scaled = evaluate(original.problem);
    expect_identical(scaled, evaluate(made.problem));
    EXPECT_NE(scaled.cost, before.cost);
  }
  original.problem.scale_losses(1.0);
  expect_identical(evaluate(original.problem), before);
}

TEST(ScaleLosses, AppliesToLaterBlocksAndSurvivesMove) {
  Problem problem;
  const auto x = problem.add(R3({3.0, 0.0, 0.0}));
  const Block first = problem.minimize(Prior<R3>{R3()}, kUnit3, {x}, Cauchy(1.0));
  problem.scale_losses(3.0);
  const Block same_pool = problem.minimize(Prior<R3>{R3()}, kUnit3, {x}, Cauchy(1.0));
  Problem moved = std::move(problem);
  const auto chaser = moved.add(SE3());
  const Block other_pool = moved.minimize(UsblPosition<SE3, R3>{Vector<3>::Zero()}, kUnit3, {chaser, x}, Cauchy(1.0));
  for (const Block& block : {first, same_pool, other_pool}) EXPECT_DOUBLE_EQ(moved.weight(block), 0.5);
  moved.scale_losses(1.0);
  for (const Block& block : {first, same_pool, other_pool}) EXPECT_DOUBLE_EQ(moved.weight(block), 0.1);
}

TEST(ScaleLosses, RejectsFactorsThatAreNotPositiveAndFinite) {
  Problem problem;
  for (const double bad : {0.0, -1.0, HUGE_VAL, std::nan("")})
    EXPECT_THAT([&] { problem.scale_losses(bad); }, ThrowsMessage<Error>(HasSubstr("not positive and finite"))) << bad;
  EXPECT_EQ(problem.loss_scale(), 1.0);
}

TEST(Weight, IsTheDerivativeOfTheLoss) {
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

TEST(Weight, FollowsItsBlockAndTheValue) {
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

TEST(Weight, RejectsHardAndRemovedBlocks) {
  Problem problem;
  const auto x = problem.add(R3());
  const Block hard = problem.subject_to(Prior<R3>{R3()}, equal_to(0), {x});
  const Block soft = problem.minimize(Prior<R3>{R3()}, kUnit3, {x});
  problem.remove(soft);
  EXPECT_THAT([&] { problem.weight(hard); }, ThrowsMessage<Error>(HasSubstr("prior is a hard block")));
  EXPECT_THAT([&] { problem.weight(soft); }, ThrowsMessage<Error>(HasSubstr("no such block")));
  EXPECT_THROW(problem.weight(Block{}), Error);
}

/// The second derivative of ½ ρ(r²) with respect to r is ρ' + 2 s ρ''.
TEST(ConvexLossScale, ConvexityLimitIsWhereTheCurvatureVanishes) {
  for (const Loss& loss : robust(1.7)) {
    const double end = loss.convexity_limit() * loss.scale * loss.scale;
    const auto curvature = [&](double s) { return loss(s).d1 + 2.0 * s * loss(s).d2; };
    for (double s = 0; s < 0.999 * end; s += 0.1 * end) EXPECT_GT(curvature(s), 0.0);
    EXPECT_LE(curvature(1.001 * end), 0.0);
  }
  EXPECT_EQ(Loss{}.convexity_limit(), HUGE_VAL);
}

TEST(ConvexLossScale, IsTheMaximumOverAllBlocks) {
  Problem problem;
  const auto x = problem.add(R3({6.0, 0.0, 0.0}));
  problem.minimize(Prior<R3>{R3()}, kUnit3, {x});
  EXPECT_EQ(problem.convex_loss_scale(), std::nullopt) << "no robust loss";
  problem.minimize(Prior<R3>{R3()}, kUnit3, {x}, Cauchy(2.0));
  EXPECT_DOUBLE_EQ(problem.convex_loss_scale().value(), 3.0);
  problem.minimize(Prior<R3>{R3()}, Gaussian{2.0, 2.0, 2.0}, {x}, GemanMcClure(0.5));
  EXPECT_DOUBLE_EQ(problem.convex_loss_scale().value(), 6.0 * std::sqrt(3.0));
  problem.scale_losses(100.0);
  EXPECT_DOUBLE_EQ(problem.convex_loss_scale().value(), 6.0 * std::sqrt(3.0))
      << "independent of the current loss_scale";
  problem.set_value(x, R3());
  EXPECT_EQ(problem.convex_loss_scale(), 0.0);
}

}  // namespace
}  // namespace tandem::testing
