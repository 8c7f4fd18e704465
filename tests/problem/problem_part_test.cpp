#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/problem_part.hpp>

#include "mixed_problem.hpp"

/// Part of a problem is a problem whose cost changes as the whole's does.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(ProblemPart, HasTheBlocksThatReadItsVariablesAndFixesTheOthers) {
  MixedProblem whole;
  const std::array ids{whole.problem.id(whole.v.q), whole.problem.id(whole.v.s)};
  ProblemPart part(whole.problem, ids);
  // q: below (soft and hard), its prior; s: carried (soft and hard), its prior. They read p besides.
  EXPECT_EQ(part.problem().num_variables(), 3);
  EXPECT_EQ(part.problem().num_soft_blocks(), 4);
  EXPECT_EQ(part.problem().num_hard_blocks(), 2);
  EXPECT_EQ(part.problem().size().unknowns, 9);
}

/// With robust losses, full covariances, constraints and a variable read twice.
TEST(ProblemPart, ItsDerivativesAreTheWholesOwn) {
  MixedProblem whole;
  const std::array ids{whole.problem.id(whole.v.b), whole.problem.id(whole.v.a)};  // in any order
  whole.problem.widen_losses(1.7);
  ProblemPart part(whole.problem, ids);
  Program all(whole.problem), some(part.problem());
  const double constant = all.cost() - some.cost();
  Eigen::VectorXd step = Eigen::VectorXd::Zero(all.num_unknowns());
  step.head<12>() = random_vector(12, 0.4, 3);  // a and b were the first
  all.move_to(step);
  some.move_to(step.head<12>());
  EXPECT_NEAR(all.cost() - some.cost(), constant, 1e-12 * all.cost());
  EXPECT_LE((gradient(all).head<12>() - gradient(some)).norm(), 1e-12 * gradient(some).norm());
  Eigen::VectorXd c(some.num_rows());
  some.constraints(c);
  EXPECT_EQ(some.num_rows(), 10);  // twist components of a b and of c b, constant twist of b a b
  EXPECT_EQ(c.size(), 10);
}

TEST(ProblemPart, ValuesGoToAndFro) {
  MixedProblem whole;
  const std::array ids{whole.problem.id(whole.v.p)};
  ProblemPart part(whole.problem, ids);
  const double before = Program(part.problem()).cost();
  const R3 was = whole.problem.value(whole.v.p);
  const SE3 other = whole.problem.value(whole.v.b);

  whole.problem.set_value(whole.v.p, R3({3, 4, 5}));
  part.take_values();
  EXPECT_NE(Program(part.problem()).cost(), before);

  whole.problem.set_value(whole.v.p, was);
  whole.problem.set_value(whole.v.b, SE3());  // fixed in the part
  part.give_values();
  EXPECT_EQ(whole.problem.value(whole.v.p).vector(), Vector<3>(3, 4, 5));
  EXPECT_EQ(whole.problem.value(whole.v.b).translation(), SE3().translation());

  whole.problem.set_value(whole.v.p, was);
  whole.problem.set_value(whole.v.b, other);
  part.take_values();
  EXPECT_EQ(Program(part.problem()).cost(), before);
}

TEST(ProblemPart, TakesNoiseAndLossesThatHaveChanged) {
  Problem problem;
  const auto x = problem.add(R3({1, 2, 3})), y = problem.add(R3());
  const Block close = problem.minimize(RelativePose<R3>{R3()}, kUnit3, {x, y});
  const Block prior = problem.minimize(Prior<R3>{R3()}, kUnit3, {x});
  problem.minimize(Prior<R3>{R3()}, kUnit3, {y});
  const std::array ids{problem.id(x)};
  ProblemPart part(problem, ids);
  Program compiled(part.problem());
  EXPECT_NEAR(compiled.cost(), 14.0, 1e-12);
  problem.set_noise(close, Gaussian{0.5, 0.5, 0.5});
  problem.set_loss(prior, Cauchy(1.0));
  problem.widen_losses(2.0);
  part.take_values();
  const double whole = Program(problem).cost();  // the third block costs nothing
  EXPECT_NE(whole, 14.0);
  EXPECT_EQ(Program(part.problem()).cost(), whole);
  compiled.reset();
  EXPECT_EQ(compiled.cost(), whole);  // what is compiled stays valid
}

TEST(ProblemPart, KnowsWhenTheWholeHasChanged) {
  MixedProblem whole;
  const std::array ids{whole.problem.id(whole.v.p)};
  ProblemPart part(whole.problem, ids);
  whole.problem.fix(whole.v.b);
  const auto changed = ThrowsMessage<Error>(HasSubstr("since a part of it was made"));
  EXPECT_THAT([&] { part.take_values(); }, changed);
  EXPECT_THAT([&] { part.give_values(); }, changed);
}

TEST(ProblemPart, RefusesWhatItCannotCopy) {
  Problem problem;
  const auto x = problem.add(R3()), y = problem.add(R3()), z = problem.add(R3());
  problem.minimize(RelativePose<R3>{R3()}, kUnit3, {x, y});
  problem.minimize(Prior<R3>{R3()}, kUnit3, {x});
  problem.minimize(Prior<R3>{R3()}, kUnit3, {z});
  const std::array nobody{7}, of_y{problem.id(y)}, of_z{problem.id(z)};
  EXPECT_THAT([&] { ProblemPart(problem, nobody); }, ThrowsMessage<Error>(HasSubstr("no variable of id 7")));
  problem.marginalize(x);
  EXPECT_THAT([&] { ProblemPart(problem, of_y); }, ThrowsMessage<Error>(HasSubstr("marginal prior")));
  EXPECT_EQ(ProblemPart(problem, of_z).problem().num_soft_blocks(), 1);
}

}  // namespace
}  // namespace tandem::testing
