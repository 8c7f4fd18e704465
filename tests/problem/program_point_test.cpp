#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/residuals/prior.hpp>

#include "mixed_problem.hpp"

// Programs of a problem that others, too, work on.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class ProgramPoint : public ::testing::Test {
 protected:
  MixedProblem mixed;
  Program program{mixed.problem};
  Eigen::VectorXd delta = random_vector(program.num_unknowns(), 0.5, 3);
};

TEST_F(ProgramPoint, EachProgramOfAProblemHasItsOwnPoint) {
  program.move_to(delta);
  const double cost = program.cost();
  const Eigen::VectorXd g = gradient(program);
  Program other(mixed.problem);
  EXPECT_NE(other.cost(), cost);
  EXPECT_EQ(program.cost(), cost);
  EXPECT_EQ(gradient(program), g);
  other.move_to(0.5 * delta);
  EXPECT_EQ(gradient(program), g);
}

TEST_F(ProgramPoint, RefusesAProblemThatHasChangedSince) {
  const auto changed = ThrowsMessage<Error>(HasSubstr("since its Program was made"));
  const auto x = mixed.problem.add(R3(), "another");
  EXPECT_THAT([&] { program.cost(); }, changed);
  Program after(mixed.problem);
  after.cost();
  mixed.problem.fix(x);
  EXPECT_THAT([&] { after.reset(); }, changed);
  Program with_block(mixed.problem);
  const Block block = mixed.problem.minimize(Prior<R3>{R3()}, Gaussian{1, 1, 1}, {x});
  EXPECT_THAT([&] { with_block.move_to(delta); }, changed);
  Program without_block(mixed.problem);
  mixed.problem.remove(block);
  EXPECT_THAT([&] { without_block.cost(); }, changed);
}

TEST_F(ProgramPoint, BlocksThatWereRefusedAreNoChange) {
  const double cost = program.cost();
  const Variable<Rn<5>> none;  // of types that the problem has not had
  EXPECT_THROW(mixed.problem.minimize(Prior<Rn<5>>{Rn<5>()}, Gaussian({1, 1, 1, 1, 1}), {none}), Error);
  EXPECT_THROW(mixed.problem.subject_to(Prior<Rn<5>>{Rn<5>()}, equal_to(0), {none}), Error);
  EXPECT_EQ(program.cost(), cost);
  EXPECT_EQ(program.describe_bad_block(), "");
}

TEST_F(ProgramPoint, ValuesThatChangeUnderItAreTakenByAReset) {
  program.move_to(delta);
  mixed.problem.set_value(mixed.v.b, mixed.problem.value(mixed.v.b));
  EXPECT_THAT([&] { program.cost(); }, ThrowsMessage<Error>(HasSubstr("values were changed")));
  program.reset();
  program.cost();
  Program other(mixed.problem);
  other.move_to(delta);
  other.recenter();
  EXPECT_THAT([&] { program.cost(); }, ThrowsMessage<Error>(HasSubstr("values were changed")));
}

}  // namespace
}  // namespace tandem::testing
