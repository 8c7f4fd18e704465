#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/subproblem.hpp>

#include "mixed_problem.hpp"

/// The cost of a Subproblem changes like the cost of the whole problem.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(Subproblem, ContainsTheBlocksOfItsVariablesAndFixesTheOthers) {
  MixedProblem whole;
  const std::array ids{whole.problem.id(whole.v.q), whole.problem.id(whole.v.s)};
  Subproblem part(whole.problem, ids);
  // q: below (soft and hard), prior. s: carried (soft and hard), prior. The blocks also read p.
  EXPECT_EQ(part.problem().num_variables(), 3);
  EXPECT_EQ(part.problem().num_soft_blocks(), 4);
  EXPECT_EQ(part.problem().num_hard_blocks(), 2);
  EXPECT_EQ(part.problem().size().unknowns, 9);
}

/// Covers robust losses, full covariances, constraints and a variable that a block reads twice.
TEST(Subproblem, DerivativesEqualThoseOfTheWholeProblem) {
  MixedProblem whole;
  const std::array ids{whole.problem.id(whole.v.b), whole.problem.id(whole.v.a)};  // the order does not matter
  whole.problem.scale_losses(1.7);
  Subproblem part(whole.problem, ids);
  NlpEvaluator all(whole.problem), some(part.problem());
  const double constant = all.cost() - some.cost();
  Eigen::VectorXd step = Eigen::VectorXd::Zero(all.num_unknowns());
  step.head<12>() = random_vector(12, 0.4, 3);  // a and b come first
  all.move_to(step);
  some.move_to(step.head<12>());
  EXPECT_NEAR(all.cost() - some.cost(), constant, 1e-12 * all.cost());
  EXPECT_LE((gradient(all).head<12>() - gradient(some)).norm(), 1e-12 * gradient(some).norm());
  Eigen::VectorXd c(some.num_rows());
  some.constraints(c);
  EXPECT_EQ(some.num_rows(), 10);  // twist components of a, b and of c, b; constant twist of b, a, b
  EXPECT_EQ(c.size(), 10);
}

TEST(Subproblem, CopiesValuesInBothDirections) {
  MixedProblem whole;
  const std::array ids{whole.problem.id(whole.v.p)};
  Subproblem part(whole.problem, ids);
  const double before = NlpEvaluator(part.problem()).cost();
  const R3 was = whole.problem.value(whole.v.p);
  const SE3 other = whole.problem.value(whole.v.b);

  whole.problem.set_value(whole.v.p, R3({3, 4, 5}));
  part.update_from_whole();
  EXPECT_NE(NlpEvaluator(part.problem()).cost(), before);

  whole.problem.set_value(whole.v.p, was);
  whole.problem.set_value(whole.v.b, SE3());  // fixed in the part
  part.write_back();
  EXPECT_EQ(whole.problem.value(whole.v.p).vector(), Vector<3>(3, 4, 5));
  EXPECT_EQ(whole.problem.value(whole.v.b).translation(), SE3().translation());

  whole.problem.set_value(whole.v.p, was);
  whole.problem.set_value(whole.v.b, other);
  part.update_from_whole();
  EXPECT_EQ(NlpEvaluator(part.problem()).cost(), before);
}

TEST(Subproblem, UpdatesNoiseAndLosses) {
  Problem problem;
  const auto x = problem.add(R3({1, 2, 3})), y = problem.add(R3());
  const Block close = problem.minimize(RelativePose<R3>{R3()}, kUnit3, {x, y});
  const Block prior = problem.minimize(Prior<R3>{R3()}, kUnit3, {x});
  problem.minimize(Prior<R3>{R3()}, kUnit3, {y});
  const std::array ids{problem.id(x)};
  Subproblem part(problem, ids);
  NlpEvaluator compiled(part.problem());
  EXPECT_NEAR(compiled.cost(), 14.0, 1e-12);
  problem.set_noise(close, Gaussian{0.5, 0.5, 0.5});
  problem.set_loss(prior, Cauchy(1.0));
  problem.scale_losses(2.0);
  part.update_from_whole();
  const double whole = NlpEvaluator(problem).cost();  // the third block costs nothing
  EXPECT_NE(whole, 14.0);
  EXPECT_EQ(NlpEvaluator(part.problem()).cost(), whole);
  compiled.reset();
  EXPECT_EQ(compiled.cost(), whole);  // the evaluator stays valid
}

TEST(Subproblem, RejectsChangedWholeProblem) {
  MixedProblem whole;
  const std::array ids{whole.problem.id(whole.v.p)};
  Subproblem part(whole.problem, ids);
  whole.problem.fix(whole.v.b);
  const auto changed = ThrowsMessage<Error>(HasSubstr("since this Subproblem was made"));
  EXPECT_THAT([&] { part.update_from_whole(); }, changed);
  EXPECT_THAT([&] { part.write_back(); }, changed);
}

TEST(Subproblem, RejectsUnknownVariablesAndMarginalPriors) {
  Problem problem;
  const auto x = problem.add(R3()), y = problem.add(R3()), z = problem.add(R3());
  problem.minimize(RelativePose<R3>{R3()}, kUnit3, {x, y});
  problem.minimize(Prior<R3>{R3()}, kUnit3, {x});
  problem.minimize(Prior<R3>{R3()}, kUnit3, {z});
  const std::array unknown{7}, of_y{problem.id(y)}, of_z{problem.id(z)};
  EXPECT_THAT([&] { Subproblem(problem, unknown); }, ThrowsMessage<Error>(HasSubstr("no variable with ID 7")));
  problem.marginalize(x);
  EXPECT_THAT([&] { Subproblem(problem, of_y); }, ThrowsMessage<Error>(HasSubstr("marginal prior")));
  EXPECT_EQ(Subproblem(problem, of_z).problem().num_soft_blocks(), 1);
}

}  // namespace
}  // namespace tandem::testing
