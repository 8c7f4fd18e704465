#include <gtest/gtest.h>

#include <tandem/solvers/curvature_choice.hpp>

namespace tandem::testing {
namespace {

TEST(CurvatureChoice, UsesLearnedCurvatureWhileStepsAreAccepted) {
  detail::CurvatureChoice choice;
  for (int step = 0; step < 1000; ++step) {
    ASSERT_TRUE(choice.use());
    choice.add(true, step % 8 != 0);  // one rejection of eight is usual
  }
}

/// Rejected steps without learned curvature do not count.
TEST(CurvatureChoice, PausesGrowWhileStepsAreRejected) {
  detail::CurvatureChoice choice;
  for (int step = 0; step < 100; ++step) choice.add(false, false);
  EXPECT_TRUE(choice.use());
  int last_pause = 0;
  for (int pauses = 0; pauses < 3; ++pauses) {
    for (int step = 0; choice.use(); ++step) {
      ASSERT_LT(step, 20);
      choice.add(true, step % 2 == 0);
    }
    int pause = 0;
    for (; !choice.use(); ++pause) choice.add(false, true);
    EXPECT_GT(pause, last_pause);
    last_pause = pause;
  }
}

}  // namespace
}  // namespace tandem::testing
