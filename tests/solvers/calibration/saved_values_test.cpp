#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/solvers/calibration/saved_values.hpp>

namespace tandem::testing {
namespace {

TEST(SavedValues, ReturnsToTheSavedValues) {
  Problem problem;
  const auto x = problem.add(SE3::Exp(Vector<6>(1, 2, 3, 0.1, 0.2, 0.3)));
  const auto y = problem.add(R3(Vector<3>(1, 2, 3)));
  const detail::SavedValues saved(problem);
  const SE3 before = problem.value(x);
  problem.set_value(x, SE3());
  problem.set_value(y, R3());
  saved.copy_to(problem);
  EXPECT_EQ(problem.value(x).matrix(), before.matrix());
  EXPECT_EQ(problem.value(y).vector(), Vector<3>(1, 2, 3));
}

/// A model with further states keeps the values of the states that both have.
TEST(SavedValues, MatchByNameIfTheNumbersDiffer) {
  Problem from, to;
  from.add(R3(Vector<3>(1, 0, 0)), "bias 0");
  from.add(R3(Vector<3>(2, 0, 0)), "drift");
  from.add(R3(Vector<3>(3, 0, 0)), "drift");
  from.add(R3(Vector<3>(4, 0, 0)), "delay");
  const auto bias = to.add(R3(), "bias 0"), added = to.add(R3(), "added");
  const auto first = to.add(R3(), "drift"), second = to.add(R3(), "drift");
  const auto delay = to.add(R3(), "delay"), another_delay = to.add(R3(), "delay");
  detail::copy_values(from, to);
  EXPECT_EQ(to.value(bias).vector()[0], 1);
  EXPECT_EQ(to.value(first).vector()[0], 2);
  EXPECT_EQ(to.value(second).vector()[0], 3);
  EXPECT_EQ(to.value(added).vector()[0], 0) << "not in the first problem";
  EXPECT_EQ(to.value(delay).vector()[0], 0) << "another number of this name";
  EXPECT_EQ(to.value(another_delay).vector()[0], 0);
}

/// A model without a misalignment has a fixed state of its group instead, which must not become the misalignment.
TEST(SavedValues, MatchByNameIfTheNumbersAreEqual) {
  Problem from, to;
  from.add(R3(Vector<3>(1, 0, 0)), "misalignment");
  from.add(R3(Vector<3>(2, 0, 0)), "delay");
  const auto delay = to.add(R3(), "delay"), none = to.add(R3(), "no error");
  to.fix(none);
  detail::copy_values(from, to);
  EXPECT_EQ(to.value(none).vector(), Vector<3>(0, 0, 0));
  EXPECT_EQ(to.value(delay).vector()[0], 2);
}

TEST(SavedValues, MoveAnotherProblemAsTheyMoved) {
  Problem from, to;
  const SE3 a = SE3::Exp(Vector<6>(1, 2, 3, 0.1, 0.2, 0.3)), step = SE3::Exp(Vector<6>(0.5, 0, 0, 0, 0, 0.2));
  const auto x = from.add(a, "pose");
  from.add(R3(), "drift");
  const detail::SavedValues before(from);
  from.set_value(x, a * step);
  const detail::SavedValues after(from);
  const SE3 b = SE3::Exp(Vector<6>(3, 1, 2, 0, 0.4, -0.3));
  const auto bias = to.add(R3(Vector<3>(7, 8, 9)), "bias");
  const auto y = to.add(b, "pose");
  after.move(before, to);
  EXPECT_LT((to.value(y).matrix() - (b * step).matrix()).norm(), 1e-12);
  EXPECT_EQ(to.value(bias).vector(), Vector<3>(7, 8, 9));
}

}  // namespace
}  // namespace tandem::testing
