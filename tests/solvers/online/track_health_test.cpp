#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/online/track_health.hpp>

namespace tandem::detail {
namespace {

constexpr std::size_t kUsbl = 0, kCamera = 1, kDepth = 2;

HealthMonitor monitor() { return HealthMonitor({{"usbl", 1}, {"camera", 1}, {"depth", 2}}, {}); }

TEST(TrackHealth, ANewTruthTakesRejectionsOverTime) {
  HealthMonitor slow = monitor(), fast = monitor();
  slow.rejected(kUsbl, 0, 9);
  slow.rejected(kUsbl, 8, 9);
  EXPECT_FALSE(slow.is_new_truth(kUsbl)) << "two are not three";
  slow.rejected(kUsbl, 16, 9);
  EXPECT_TRUE(slow.is_new_truth(kUsbl));
  for (int i = 0; i < 60; ++i) fast.rejected(kUsbl, 0.1 * i, 9);
  EXPECT_FALSE(fast.is_new_truth(kUsbl)) << "for six seconds";
  for (int i = 60; i < 75; ++i) fast.rejected(kUsbl, 0.1 * i, 9);
  EXPECT_TRUE(fast.is_new_truth(kUsbl));
}

TEST(TrackHealth, WhatIsUsedNowAndThenIsNoNewTruth) {
  HealthMonitor m = monitor();
  for (int i = 0; i < 200; ++i) {
    if (i % 2)
      m.used(kUsbl, 0.1 * i, 1.0);
    else
      m.rejected(kUsbl, 0.1 * i, 9);
    ASSERT_FALSE(m.is_new_truth(kUsbl)) << i;
  }
}

TEST(TrackHealth, AnotherSensorOfTheSameThingIsAWitness) {
  HealthMonitor m = monitor();
  for (int i = 0; i < 20; ++i) {
    m.rejected(kUsbl, i, 9);
    m.used(kCamera, i, 1.0);
  }
  EXPECT_FALSE(m.is_new_truth(kUsbl));
  HealthMonitor other = monitor();
  for (int i = 0; i < 20; ++i) {
    other.rejected(kUsbl, i, 9);
    other.used(kDepth, i, 1.0);
  }
  EXPECT_TRUE(other.is_new_truth(kUsbl)) << "a depth says nothing of it";
}

TEST(TrackHealth, RejectedIsNotReceivedAndARestartForgetsIt) {
  HealthMonitor m = monitor();
  m.used(kUsbl, 1, 0.5);
  for (int i = 2; i < 20; ++i) m.rejected(kUsbl, i, 9);
  EXPECT_EQ(m.health().sensors[kUsbl].last_used, 1.0);
  EXPECT_EQ(m.health().sensors[kUsbl].rejected, 18u);
  EXPECT_EQ(m.last_used(0, 2), 1.0);
  EXPECT_EQ(m.last_used(1, 2), -HUGE_VAL);
  m.restarted(TrackReset::Kind::new_truth);
  EXPECT_FALSE(m.is_new_truth(kUsbl));
  EXPECT_EQ(m.health().resets, 1u);
  EXPECT_EQ(m.health().sensors[kUsbl].rejected, 18u) << "counts stay";
  m.restarted(TrackReset::Kind::suspended);
  EXPECT_EQ(m.health().resets, 1u);
  EXPECT_EQ(m.health().suspensions, 1u);
}

TEST(TrackHealth, AWindowThatStaysUnconvergedIsStuck) {
  HealthMonitor m = monitor();
  for (int i = 0; i < 30; ++i) {
    m.updated(i, false);
    EXPECT_FALSE(m.is_stuck(i)) << i;
  }
  m.updated(30, false);
  EXPECT_TRUE(m.is_stuck(30));
  EXPECT_EQ(m.health().unconverged_since, 0.0);
  m.updated(31, true);
  EXPECT_FALSE(m.is_stuck(31));
}

TEST(TrackHealth, OutputsAreAidedLostAndInvalidByTheirAge) {
  HealthMonitor m({{"usbl", 1}}, {.lost_after = 5, .invalid_after = 10});
  m.at(3, {}, {});
  EXPECT_EQ(m.health().target.state, OutputState::none);
  m.at(8, 8, 3);
  EXPECT_EQ(m.health().chaser.state, OutputState::aided);
  EXPECT_EQ(m.health().target.state, OutputState::aided) << "for five seconds";
  m.at(8.1, 8, 3);
  EXPECT_EQ(m.health().target.state, OutputState::lost);
  EXPECT_NEAR(m.health().target.age, 5.1, 1e-12);
  m.at(13.1, 13, 3);
  EXPECT_EQ(m.health().target.state, OutputState::invalid);
  EXPECT_EQ(m.health().chaser.state, OutputState::aided);
  m.at(14, 14, 13.5);
  EXPECT_EQ(m.health().target.state, OutputState::aided) << "a measurement that is used brings it back";
}

TEST(TrackHealth, WhatDoesNotConvergeForLongIsInvalidHoweverFresh) {
  HealthMonitor m({{"usbl", 1}}, {.lost_after = 5, .invalid_after = 10});
  for (int t = 0; t <= 11; ++t) {
    m.updated(t, false);
    m.at(t, t, t);
    EXPECT_EQ(m.health().target.state, t > 10 ? OutputState::invalid : OutputState::aided) << t;
  }
  m.updated(12, true);
  m.at(12, 12, 12);
  EXPECT_EQ(m.health().chaser.state, OutputState::aided);
}

TEST(TrackHealth, OptionsThatCannotWork) {
  EXPECT_NO_THROW(tandem::check(ResetOptions{}));
  EXPECT_NO_THROW(tandem::check(ResetOptions::never()));
  EXPECT_THROW(tandem::check({.gate = 0}), Error);
  EXPECT_THROW(tandem::check({.rejected_of = 2, .rejections = 3}), Error);
  EXPECT_THROW(tandem::check({.max_gap = 0}), Error);
  EXPECT_THROW(tandem::check({.lost_after = 0}), Error);
  EXPECT_THROW(tandem::check({.invalid_after = std::nan("")}), Error);
}

}  // namespace
}  // namespace tandem::detail
