#include <gtest/gtest.h>

#include <tandem/studies/online/replay_log.hpp>

namespace tandem {
namespace {

FeedLine line_at(double t, bool time_reset = false) { return {t, 0, time_reset, Stamped<SE3>{t, SE3()}}; }

/// Adds a line and an update per second.
void pass(ReplayLog& log, double from, double to) {
  for (double t = from; t <= to; ++t) {
    log.add(line_at(t));
    if (log.wants_state(t)) log.add_state({.t = t});
  }
}

TEST(ReplayLog, KeepsOneToTwoWindows) {
  ReplayLog log({.window = 60, .reach = 1000, .odometry = false});
  pass(log, 0, 119);
  EXPECT_FALSE(log.start());
  EXPECT_EQ(log.lines().front().t, 0);
  for (double t = 120; t < 1000; ++t) {
    pass(log, t, t);
    ASSERT_TRUE(log.start());
    EXPECT_GE(t - log.start()->t, 60);
    EXPECT_LT(t - log.start()->t, 120);
    EXPECT_LE(log.lines().front().t, log.start()->t) << "the lines begin before the state";
    EXPECT_LE(log.start()->t - log.lines().front().t, 2);
    EXPECT_EQ(log.lines().back().t, t);
  }
}

TEST(ReplayLog, ForgetsLinesBeforeTimeReset) {
  ReplayLog log({.window = 60, .reach = 1000, .odometry = false});
  pass(log, 0, 500);
  log.add(line_at(7, true));
  EXPECT_FALSE(log.start());
  EXPECT_EQ(log.lines().size(), 1u);
}

TEST(ReplayLog, IsBoundedWithoutStates) {
  ReplayLog log({.window = 60, .reach = 300, .odometry = false});
  pass(log, 0, 200);
  for (double t = 201; t < 5000; ++t) log.add(line_at(t));
  EXPECT_EQ(log.lines().size(), 301u);
  EXPECT_FALSE(log.start()) << "the state is older than all lines";
}

TEST(ReplayLog, ContinuesFromGivenState) {
  ReplayLog log({.window = 60, .reach = 1000, .odometry = false}, Alignment{.t = 100});
  pass(log, 99, 130);
  ASSERT_TRUE(log.start());
  EXPECT_EQ(log.start()->t, 100);
  EXPECT_EQ(log.lines().front().t, 99);
  pass(log, 131, 300);
  EXPECT_GE(log.start()->t, 160);
}

}  // namespace
}  // namespace tandem
