#include <deque>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>

#include "allocation_count.hpp"
#include "mixed_problem.hpp"

namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(Removal, RemovesVariableThatNoBlockReads) {
  Problem problem;
  const auto x = problem.add(R3({1, 2, 3}), "x"), y = problem.add(R3({4, 5, 6}), "y");
  const Block block = problem.minimize(RelativePose<R3>{R3()}, kUnit3, {x, y});
  EXPECT_THAT([&] { problem.remove(x); },
              ThrowsMessage<Error>(HasSubstr("remove: variable x is still read by a block (relative pose of x, y)")));
  problem.remove(block);
  EXPECT_TRUE(problem.has(x));
  problem.remove(x);
  EXPECT_FALSE(problem.has(x));
  EXPECT_TRUE(problem.has(y));
  EXPECT_EQ(problem.num_variables(), 1);
  EXPECT_EQ(problem.size().unknowns, 3);
  EXPECT_EQ(problem.value(y).vector(), Vector<3>(4, 5, 6));
}

TEST(Removal, RejectsHandlesOfRemovedVariables) {
  Problem problem;
  const auto x = problem.add(R3({1, 2, 3}), "x");
  problem.remove(x);
  const auto y = problem.add(R3({4, 5, 6}), "y");  // reuses the slot of x
  const auto removed = ThrowsMessage<Error>(HasSubstr("has been removed"));
  EXPECT_THAT([&] { problem.value(x); }, removed);
  EXPECT_THAT([&] { problem.id(x); }, removed);
  EXPECT_THAT([&] { problem.set_value(x, R3()); }, removed);
  EXPECT_EQ(problem.value(y).vector(), Vector<3>(4, 5, 6));
  const auto never = ThrowsMessage<Error>(HasSubstr("never added"));
  EXPECT_THAT([&] { problem.value(Variable<R3>{}); }, never);
  EXPECT_THAT([&] { problem.id(Variable<R3>{}); }, never);
  EXPECT_FALSE(problem.has(Variable<R3>{}));
}

TEST(Removal, ReusedSlotsInvalidateOldHandles) {
  Problem problem;
  const auto x = problem.add(R3({1, 2, 3}), "x");
  const Block old_block = problem.minimize(Prior<R3>{R3()}, kUnit3, {x});
  problem.remove(old_block);
  problem.remove(x);
  const auto y = problem.add(R3({4, 5, 6}), "y");
  EXPECT_EQ(problem.id(y), 0);  // the ID of x
  EXPECT_FALSE(problem.has(x));
  EXPECT_TRUE(problem.has(y));
  EXPECT_THAT([&] { problem.set_value(x, R3()); }, ThrowsMessage<Error>(HasSubstr("has been removed")));
  EXPECT_THROW(problem.remove(x), Error);
  EXPECT_THROW(problem.minimize(Prior<R3>{R3()}, kUnit3, {x}), Error);
  const Block block = problem.minimize(Prior<R3>{R3()}, kUnit3, {y});
  EXPECT_EQ(block.id, old_block.id);
  EXPECT_THROW(problem.remove(old_block), Error);
  EXPECT_THROW(problem.weight(old_block), Error);
  EXPECT_EQ(problem.weight(block), 1.0);
  Problem other;
  EXPECT_FALSE(other.has(y));
}

TEST(Removal, SequenceNumberDistinguishesReusedIds) {
  Problem problem;
  const auto x = problem.add(R3()), y = problem.add(R3());
  const int id = problem.id(x);
  EXPECT_EQ(problem.sequence_number(id), 0);
  EXPECT_EQ(problem.sequence_number(problem.id(y)), 1);
  problem.remove(x);
  EXPECT_EQ(problem.sequence_number(id), -1);
  const auto z = problem.add(R3());
  ASSERT_EQ(problem.id(z), id);
  EXPECT_EQ(problem.sequence_number(id), 2);
}

TEST(Removal, UnknownsAreInTheOrderOfCreation) {
  Problem problem;
  std::deque<Variable<R3>> x;
  for (int k = 0; k < 5; ++k) x.push_back(problem.add(R3()));
  for (int k = 0; k < 8; ++k) {
    problem.remove(x[1]);
    x.erase(x.begin() + 1);
    x.push_back(problem.add(R3()));
    const NlpEvaluator nlp(problem);
    for (int i = 0; i < 5; ++i) EXPECT_EQ(nlp.block_of(problem.id(x[std::size_t(i)])), i);
  }
  EXPECT_EQ(problem.id_bound(), 5);
  problem.fix(x[0]);
  problem.remove(x[3]);
  const int gone = 4 * 5 / 2 - [&] {
    int sum = 0;
    for (const int i : {0, 1, 2, 4}) sum += problem.id(x[std::size_t(i)]);
    return sum;
  }();
  const NlpEvaluator nlp(problem);
  EXPECT_EQ(nlp.block_of(gone), -1);
  EXPECT_EQ(nlp.block_of(problem.id(x[0])), -1);
  EXPECT_EQ(nlp.block_of(problem.id(x[4])), 2);
  EXPECT_EQ(nlp.num_unknowns(), 9);
}

TEST(Removal, SlidingWindowNeedsConstantMemory) {
  Problem problem;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  covariance(0, 1) = covariance(1, 0) = 0.5;
  const Gaussian full = Gaussian::covariance(covariance);
  std::deque<std::pair<Variable<R3>, Block>> window;
  const auto slide = [&] {
    const auto x = problem.add(R3({1, 2, 3}));
    window.emplace_back(x, problem.minimize(Prior<R3>{R3()}, full, {x}));
    if (window.size() <= 20) return;
    problem.remove(window.front().second);
    problem.remove(window.front().first);
    window.pop_front();
  };
  for (int k = 0; k < 100; ++k) slide();
  int largest_block = 0;
  const auto allocations_of_slides = [&] {
    const long before = allocations;
    for (int k = 0; k < 5000; ++k) {
      slide();
      largest_block = std::max(largest_block, window.back().second.id);
    }
    return allocations - before;
  };
  const long first = allocations_of_slides();
  EXPECT_EQ(allocations_of_slides(), first) << "no array of the problem grows";
  EXPECT_EQ(problem.num_variables(), 20);
  EXPECT_EQ(problem.num_soft_blocks(), 20);
  EXPECT_EQ(problem.id_bound(), 21);
  EXPECT_LE(largest_block, 20);
  // The cost of each block is ½ xᵀ Σ⁻¹ x if its noise matrix moved along with it.
  const Vector<3> v(1, 2, 3);
  EXPECT_NEAR(NlpEvaluator(problem).cost(), 20 * 0.5 * v.dot(covariance.inverse() * v), 1e-9);
}

}  // namespace
}  // namespace tandem::testing
