#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/online/track_health.hpp>

namespace tandem::detail {
namespace {

constexpr std::size_t kUsbl = 0, kCamera = 1, kDepth = 2;

HealthMonitor monitor() { return HealthMonitor({{"usbl", 1}, {"camera", 1}, {"depth", 2}}, {}); }

TEST(TrackHealth, AContradictionNeedsRejectionsOverTime) {
  HealthMonitor slow = monitor(), fast = monitor();
  slow.rejected(kUsbl, 0, 9);
  slow.rejected(kUsbl, 8, 9);
  EXPECT_FALSE(slow.must_reset_to(kUsbl)) << "only two rejections";
  slow.rejected(kUsbl, 16, 9);
  EXPECT_TRUE(slow.must_reset_to(kUsbl));
  for (int i = 0; i < 60; ++i) fast.rejected(kUsbl, 0.1 * i, 9);
  EXPECT_FALSE(fast.must_reset_to(kUsbl)) << "only six seconds";
  for (int i = 60; i < 75; ++i) fast.rejected(kUsbl, 0.1 * i, 9);
  EXPECT_TRUE(fast.must_reset_to(kUsbl));
}

TEST(TrackHealth, OccasionalRejectionsAreNoContradiction) {
  HealthMonitor m = monitor();
  for (int i = 0; i < 200; ++i) {
    if (i % 2)
      m.used(kUsbl, 0.1 * i, {.sigmas = 1.0});
    else
      m.rejected(kUsbl, 0.1 * i, 9);
    ASSERT_FALSE(m.must_reset_to(kUsbl)) << i;
  }
}

TEST(TrackHealth, AnotherSensorOfTheSameSubjectConfirmsTheEstimate) {
  HealthMonitor m = monitor();
  for (int i = 0; i < 20; ++i) {
    m.rejected(kUsbl, i, 9);
    m.used(kCamera, i, {.sigmas = 1.0});
  }
  EXPECT_FALSE(m.must_reset_to(kUsbl));
  HealthMonitor other = monitor();
  for (int i = 0; i < 20; ++i) {
    other.rejected(kUsbl, i, 9);
    other.used(kDepth, i, {.sigmas = 1.0});
  }
  EXPECT_TRUE(other.must_reset_to(kUsbl)) << "a depth sensor has another subject";
}

/// A position that steps while the receiver is in use does not win against a DVL, however long it lasts. The first
/// positions after an absence of the receiver are accepted.
TEST(TrackHealth, ASensorThatContradictsTheOthersDoesNotWinByPersisting) {
  constexpr std::size_t kGps = 0, kDvl = 1, kDepth = 2;
  constexpr unsigned motion = (1u << 1) | (1u << 2);
  const std::vector<HealthMonitor::Sensor> sensors{{"gps", 1, motion}, {"dvl", 2, motion}, {"depth", 3, motion}};
  HealthMonitor m(sensors, {}), absent(sensors, {}), both(sensors, {}), height(sensors, {});
  for (int i = -70; i < 1; ++i) m.used(kGps, i, {.sigmas = 1});
  absent.used(kGps, 0, {.sigmas = 1});
  for (int i = 1; i < 600; ++i) {
    m.rejected(kGps, i, 9);
    m.used(kDvl, i, {.sigmas = 1});
    EXPECT_FALSE(m.must_reset_to(kGps)) << i;
    absent.used(kDvl, i, {.sigmas = 1});
    if (i > 60) absent.rejected(kGps, i, 9);
    both.rejected(kGps, i, 9);
    both.rejected(kDvl, i, 9);
    height.used(kDepth, i, {.sigmas = 1});
    height.rejected(kDvl, i, 9);
  }
  EXPECT_TRUE(absent.must_reset_to(kGps));
  EXPECT_TRUE(both.must_reset_to(kDvl)) << "nothing confirms the estimate";
  EXPECT_TRUE(height.must_reset_to(kDvl)) << "a depth says nothing of the horizontal velocity";
}

/// A wrong first position agrees with all velocities. The later positions of the same receiver outvote it.
TEST(TrackHealth, AWrongFirstMeasurementIsOutvotedByTheFollowingOnes) {
  HealthMonitor m({{"gps", 1, 1u << 2}, {"dvl", 2, 1u << 1}}, {});
  m.used(0, 0, {.sigmas = 1});
  for (int i = 1; i < 7; ++i) {
    m.rejected(0, i, 300);
    m.used(1, i, {.sigmas = 1});
    EXPECT_FALSE(m.must_reset_to(0)) << i;
  }
  for (int i = 7; i < 10; ++i) m.rejected(0, i, 300);
  EXPECT_TRUE(m.must_reset_to(0));
}

/// The same holds for many wrong first heights. Until then, nothing confirms the output.
TEST(TrackHealth, WrongFirstMeasurementsAreOutvotedByMoreLaterOnes) {
  const auto monitor_after = [](double scatter) {
    HealthMonitor m({{"depth", 1, 1u << 2, true}, {"dvl", 2, 1u << 1}}, {});
    for (int i = 0; i < 30; ++i) m.used(0, i, {.sigmas = 1});
    for (int i = 30; i < 60; ++i) {
      m.rejected(0, i, i % 2 ? 300 : 300 * scatter);
      m.used(1, i, {.sigmas = 1});
      m.update_outputs(i, i, {});
      EXPECT_FALSE(m.must_reset_to(0)) << i;
      EXPECT_EQ(m.health().chaser.state, i < 37 ? OutputState::aided : OutputState::unconfirmed) << i;
    }
    m.rejected(0, 60, 300);
    m.used(1, 60, {.sigmas = 1});
    return m;
  };
  EXPECT_TRUE(monitor_after(1).must_reset_to(0));
  EXPECT_FALSE(monitor_after(3).must_reset_to(0)) << "the later heights contradict each other";
}

TEST(TrackHealth, SensorsOfSeveralSubjectsContradictTogether) {
  HealthMonitor m({{"gps", 1}, {"dvl", 2}, {"depth", 3}}, {});
  for (int i = 0; i < 5; ++i) m.rejected(1, 10 + i, 9);
  EXPECT_FALSE(m.all_contradicting_since(15)) << "the DVL alone may be wrong";
  for (int i = 0; i < 3; ++i) m.rejected(2, 12 + i, 9);
  EXPECT_EQ(m.all_contradicting_since(15), 10.0);
  EXPECT_EQ(m.contradicting_sensors(15), "dvl and depth");
  EXPECT_FALSE(m.all_contradicting_since(60)) << "long ago";
  m.used(2, 15, {.sigmas = 1});
  EXPECT_FALSE(m.all_contradicting_since(15));
}

TEST(TrackHealth, AnAdoptedSensorLeavesTheOutputUnconfirmedUntilAnotherAgrees) {
  HealthMonitor m({{"usbl", -1}, {"camera", -1}}, {});
  m.used(0, 1, {.sigmas = 1});
  for (int i = 2; i < 12; ++i) m.rejected(0, i, 9);
  ASSERT_TRUE(m.must_reset_to(0));
  m.adopt(0);
  m.record_reset(TrackReset::Kind::contradicted);
  m.used(0, 12, {.sigmas = 1});
  m.update_outputs(12, {}, 12);
  EXPECT_EQ(m.health().target.state, OutputState::unconfirmed);
  m.used(1, 13, {.sigmas = 1});
  m.update_outputs(13, {}, 13);
  EXPECT_EQ(m.health().target.state, OutputState::aided);
}

TEST(TrackHealth, AResetForgetsRejectionsButKeepsCounts) {
  HealthMonitor m = monitor();
  m.used(kUsbl, 1, {.sigmas = 0.5});
  for (int i = 2; i < 20; ++i) m.rejected(kUsbl, i, 9);
  EXPECT_EQ(m.health().sensors[kUsbl].last_used, 1.0);
  EXPECT_EQ(m.health().sensors[kUsbl].rejected, 18u);
  EXPECT_EQ(m.last_used(0, 2), 1.0);
  EXPECT_EQ(m.last_used(1, 2), -HUGE_VAL);
  m.record_reset(TrackReset::Kind::contradicted);
  EXPECT_FALSE(m.must_reset_to(kUsbl));
  EXPECT_EQ(m.health().resets, 1u);
  EXPECT_EQ(m.health().sensors[kUsbl].rejected, 18u) << "counts stay";
  m.record_reset(TrackReset::Kind::suspended);
  EXPECT_EQ(m.health().resets, 1u);
  EXPECT_EQ(m.health().suspensions, 1u);
}

TEST(TrackHealth, IsStuckAfterManyUnconvergedUpdates) {
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

TEST(TrackHealth, OutputStatesFollowTheirAge) {
  HealthMonitor m({{"usbl", 1}}, {.lost_after = 5, .invalid_after = 10});
  m.update_outputs(3, {}, {});
  EXPECT_EQ(m.health().target.state, OutputState::none);
  m.update_outputs(8, 8, 3);
  EXPECT_EQ(m.health().chaser.state, OutputState::aided);
  EXPECT_EQ(m.health().target.state, OutputState::aided) << "only five seconds";
  m.update_outputs(8.1, 8, 3);
  EXPECT_EQ(m.health().target.state, OutputState::lost);
  EXPECT_NEAR(m.health().target.age, 5.1, 1e-12);
  m.update_outputs(13.1, 13, 3);
  EXPECT_EQ(m.health().target.state, OutputState::invalid);
  EXPECT_EQ(m.health().chaser.state, OutputState::aided);
  m.update_outputs(14, 14, 13.5);
  EXPECT_EQ(m.health().target.state, OutputState::aided) << "a used measurement restores it";
}

TEST(TrackHealth, OutputsBecomeInvalidWithoutConvergence) {
  HealthMonitor m({{"usbl", 1}}, {.lost_after = 5, .invalid_after = 10});
  for (int t = 0; t <= 11; ++t) {
    m.updated(t, false);
    m.update_outputs(t, t, t);
    EXPECT_EQ(m.health().target.state, t > 10 ? OutputState::invalid : OutputState::aided) << t;
  }
  m.updated(12, true);
  m.update_outputs(12, 12, 12);
  EXPECT_EQ(m.health().chaser.state, OutputState::aided);
}

TEST(TrackHealth, AShiftOfUsedInnovationsLeavesTheOutputUnconfirmed) {
  HealthMonitor m = monitor();
  const auto state_after = [&](int t, double innovation) {
    m.used(kUsbl, t, {.sigmas = std::abs(innovation), .standardised = Vector<1>(innovation)});
    m.update_outputs(t, t, t);
    return m.health().chaser.state;
  };
  for (int t = 0; t < 50; ++t) ASSERT_EQ(state_after(t, t % 2 ? 1 : -1), OutputState::aided);
  for (int t = 50; t < 53; ++t) state_after(t, 4);
  EXPECT_EQ(state_after(53, 4), OutputState::unconfirmed);
  for (int t = 54; t < 70; ++t) state_after(t, t % 2 ? 1 : -1);
  EXPECT_EQ(m.health().chaser.state, OutputState::aided);
}

TEST(TrackHealth, RejectsInvalidOptions) {
  EXPECT_NO_THROW(tandem::check(ResetOptions{}));
  EXPECT_NO_THROW(tandem::check(ResetOptions::never()));
  EXPECT_THROW(tandem::check({.gate = 0}), Error);
  EXPECT_THROW(tandem::check({.rejection_window = 2, .rejections = 3}), Error);
  EXPECT_THROW(tandem::check({.max_gap = 0}), Error);
  EXPECT_THROW(tandem::check({.lost_after = 0}), Error);
  EXPECT_THROW(tandem::check({.invalid_after = std::nan("")}), Error);
}

}  // namespace
}  // namespace tandem::detail
