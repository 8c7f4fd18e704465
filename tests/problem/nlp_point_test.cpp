#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/residuals/prior.hpp>

#include "mixed_problem.hpp"

// NlpEvaluator and later changes of the problem, by the caller or by another evaluator.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class NlpEvaluatorPoint : public ::testing::Test {
 protected:
  MixedProblem mixed;
  NlpEvaluator nlp{mixed.problem};
  Eigen::VectorXd delta = random_vector(nlp.num_unknowns(), 0.5, 3);
};

TEST_F(NlpEvaluatorPoint, EachEvaluatorHasItsOwnPoint) {
  nlp.move_to(delta);
  const double cost = nlp.cost();
  const Eigen::VectorXd g = gradient(nlp);
  NlpEvaluator other(mixed.problem);
  EXPECT_NE(other.cost(), cost);
  EXPECT_EQ(nlp.cost(), cost);
  EXPECT_EQ(gradient(nlp), g);
  other.move_to(0.5 * delta);
  EXPECT_EQ(gradient(nlp), g);
}

TEST_F(NlpEvaluatorPoint, RejectsChangedProblem) {
  const auto changed = ThrowsMessage<Error>(HasSubstr("since its NlpEvaluator was made"));
  const auto x = mixed.problem.add(R3(), "another");
  EXPECT_THAT([&] { nlp.cost(); }, changed);
  NlpEvaluator after(mixed.problem);
  after.cost();
  mixed.problem.fix(x);
  EXPECT_THAT([&] { after.reset(); }, changed);
  NlpEvaluator with_block(mixed.problem);
  const Block block = mixed.problem.minimize(Prior<R3>{R3()}, Gaussian{1, 1, 1}, {x});
  EXPECT_THAT([&] { with_block.move_to(delta); }, changed);
  NlpEvaluator without_block(mixed.problem);
  mixed.problem.remove(block);
  EXPECT_THAT([&] { without_block.cost(); }, changed);
}

TEST_F(NlpEvaluatorPoint, RejectedBlocksAreNoChange) {
  const double cost = nlp.cost();
  const Variable<Rn<5>> none;  // of a group that the problem does not have
  EXPECT_THROW(mixed.problem.minimize(Prior<Rn<5>>{Rn<5>()}, Gaussian({1, 1, 1, 1, 1}), {none}), Error);
  EXPECT_THROW(mixed.problem.subject_to(Prior<Rn<5>>{Rn<5>()}, equal_to(0), {none}), Error);
  EXPECT_EQ(nlp.cost(), cost);
  EXPECT_EQ(nlp.describe_nonfinite_block(), "");
}

TEST_F(NlpEvaluatorPoint, ResetAcceptsChangedValues) {
  nlp.move_to(delta);
  mixed.problem.set_value(mixed.v.b, mixed.problem.value(mixed.v.b));
  EXPECT_THAT([&] { nlp.cost(); }, ThrowsMessage<Error>(HasSubstr("values were changed")));
  nlp.reset();
  nlp.cost();
  NlpEvaluator other(mixed.problem);
  other.move_to(delta);
  other.recenter();
  EXPECT_THAT([&] { nlp.cost(); }, ThrowsMessage<Error>(HasSubstr("values were changed")));
}

}  // namespace
}  // namespace tandem::testing
