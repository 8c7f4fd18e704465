#include <gtest/gtest.h>

#include <tandem/studies/live/replay_log.hpp>

namespace tandem {
namespace {

FeedLine line_at(double t, bool anew = false) { return {t, 0, anew, Stamped<SE3>{t, SE3()}}; }

/// A line and an update a second, from t on.
void pass(ReplayLog& log, double from, double to) {
  for (double t = from; t <= to; ++t) {
    log.add(line_at(t));
    if (log.wants_state(t)) log.note({.t = t});
  }
}

TEST(ReplayLog, HasAllLinesFirstThenThoseOfTheLastOneToTwoWindows) {
  ReplayLog log({.window = 60, .reach = 1000, .odometry = false});
  pass(log, 0, 119);
  EXPECT_FALSE(log.start());
  EXPECT_EQ(log.lines().front().t, 0);
  for (double t = 120; t < 1000; ++t) {
    pass(log, t, t);
    ASSERT_TRUE(log.start());
    EXPECT_GE(t - log.start()->t, 60);
    EXPECT_LT(t - log.start()->t, 120);
    EXPECT_LE(log.lines().front().t, log.start()->t) << "a state is placed among the lines";
    EXPECT_LE(log.start()->t - log.lines().front().t, 2);
    EXPECT_EQ(log.lines().back().t, t);
  }
}

TEST(ReplayLog, TimeThatBeginsAnewForgetsWhatWas) {
  ReplayLog log({.window = 60, .reach = 1000, .odometry = false});
  pass(log, 0, 500);
  log.add(line_at(7, true));
  EXPECT_FALSE(log.start());
  EXPECT_EQ(log.lines().size(), 1u);
}

TEST(ReplayLog, IsBoundedWhereNothingIsTracked) {
  ReplayLog log({.window = 60, .reach = 300, .odometry = false});
  pass(log, 0, 200);
  for (double t = 201; t < 5000; ++t) log.add(line_at(t));
  EXPECT_EQ(log.lines().size(), 301u);
  EXPECT_FALSE(log.start()) << "that state is older than all lines";
}

TEST(ReplayLog, GoesOnFromAStart) {
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
