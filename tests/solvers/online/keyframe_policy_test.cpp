#include <gtest/gtest.h>

#include <tandem/solvers/online/keyframe_policy.hpp>

/// The decision about the next keyframe, without an estimator.
namespace tandem::detail {
namespace {

/// Keyframes every second up to 10 s, and motion up to `motion_end`.
OnlineProgress at(double motion_end) {
  return {.newest = 10,
          .interval = 1,
          .motion_end = motion_end,
          .keyframe_limit = motion_end,
          .expects_target = true,
          .attaches_to_earlier = true,
          .finished = false};
}
constexpr EventQueue::Next target(double t) { return {t, true}; }
constexpr EventQueue::Next own(double t) { return {t, false}; }

TEST(KeyframePolicy, AddsAKeyframePerIntervalWithoutMeasurements) {
  EXPECT_EQ(next_step(at(10.9), {}), NextStep::wait);
  EXPECT_EQ(next_step(at(11.0), {}), NextStep::wait) << "a target measurement at 11 s may still arrive";
  EXPECT_EQ(next_step(at(11.01), {}), NextStep::keyframe);
  OnlineProgress alone = at(11.0);
  alone.expects_target = false;
  EXPECT_EQ(next_step(alone, {}), NextStep::keyframe);
  OnlineProgress finished = at(11.0);
  finished.finished = true;
  EXPECT_EQ(next_step(finished, {}), NextStep::keyframe);
  OnlineProgress nothing;
  EXPECT_EQ(next_step(nothing, {}), NextStep::wait);
  nothing.finished = true;
  nothing.motion_end = HUGE_VAL;
  EXPECT_EQ(next_step(nothing, {}), NextStep::wait) << "there is no first keyframe";
}

TEST(KeyframePolicy, ProcessesTargetMeasurementsOnceTheMotionIsKnown) {
  EXPECT_EQ(next_step(at(10.4), target(10.5)), NextStep::wait);
  EXPECT_EQ(next_step(at(10.5), target(10.5)), NextStep::event);
  EXPECT_EQ(next_step(at(11.0), target(11.0)), NextStep::event);
  EXPECT_EQ(next_step(at(11.2), target(11.5)), NextStep::keyframe) << "the keyframe at 11 s comes first";
  EXPECT_EQ(next_step(at(10.5), target(7.0)), NextStep::event) << "a late measurement";
  OnlineProgress first = at(3.0);
  first.newest = -HUGE_VAL;
  EXPECT_EQ(next_step(first, target(3.0)), NextStep::event);
}

TEST(KeyframePolicy, ChaserMeasurementsWaitForTheKeyframeOfTheirTime) {
  EXPECT_EQ(next_step(at(10.5), own(10.5)), NextStep::wait) << "a target measurement at 10.5 s may still arrive";
  EXPECT_EQ(next_step(at(10.52), own(10.5)), NextStep::event);
  EXPECT_EQ(next_step(at(11.0), own(11.0)), NextStep::wait);
  EXPECT_EQ(next_step(at(11.02), own(11.0)), NextStep::keyframe);
  EXPECT_EQ(next_step(at(10.0), own(10.0)), NextStep::event) << "the keyframe exists";
  EXPECT_EQ(next_step(at(10.5), own(4.0)), NextStep::event);
  OnlineProgress alone = at(10.5);
  alone.expects_target = false;
  EXPECT_EQ(next_step(alone, own(10.5)), NextStep::event);
  OnlineProgress short_of_it = at(10.9999);
  short_of_it.finished = true;
  EXPECT_EQ(next_step(short_of_it, own(10.9999)), NextStep::event) << "no keyframe will come";
}

TEST(KeyframePolicy, ChaserMeasurementsCreateKeyframesWithoutAnImu) {
  OnlineProgress now = at(10.5);
  now.attaches_to_earlier = false;
  EXPECT_EQ(next_step(now, own(10.5)), NextStep::event);
  EXPECT_EQ(next_step(now, own(10.6)), NextStep::wait);
  now.motion_end = now.keyframe_limit = 11.0;
  EXPECT_EQ(next_step(now, own(11.0)), NextStep::event);
}

}  // namespace
}  // namespace tandem::detail
