#include <gtest/gtest.h>

#include <tandem/solvers/online/keyframe_policy.hpp>

/// Where the next keyframe stands: the decision alone, without an estimate.
namespace tandem::detail {
namespace {

/// Keyframes to 10 s and the motion to `reached`, a second from one to the next.
OnlineProgress at(double reached) {
  return {.newest = 10,
          .interval = 1,
          .reached = reached,
          .last_motion = reached,
          .target_may_come = true,
          .joins_earlier = true,
          .finished = false};
}
constexpr EventQueue::Next target(double t) { return {t, true}; }
constexpr EventQueue::Next own(double t) { return {t, false}; }

TEST(KeyframePolicy, WithoutMeasurementsAKeyframeEachInterval) {
  EXPECT_EQ(next_step(at(10.9), {}), NextStep::wait);
  EXPECT_EQ(next_step(at(11.0), {}), NextStep::wait) << "the target may still be seen at 11 s";
  EXPECT_EQ(next_step(at(11.01), {}), NextStep::keyframe);
  OnlineProgress alone = at(11.0);
  alone.target_may_come = false;
  EXPECT_EQ(next_step(alone, {}), NextStep::keyframe);
  OnlineProgress finished = at(11.0);
  finished.finished = true;
  EXPECT_EQ(next_step(finished, {}), NextStep::keyframe);
  OnlineProgress nothing;
  EXPECT_EQ(next_step(nothing, {}), NextStep::wait);
  nothing.finished = true;
  nothing.reached = HUGE_VAL;
  EXPECT_EQ(next_step(nothing, {}), NextStep::wait) << "there is no first keyframe";
}

TEST(KeyframePolicy, TheTargetsMeasurementsMakeKeyframesOnceTheMotionIsThere) {
  EXPECT_EQ(next_step(at(10.4), target(10.5)), NextStep::wait);
  EXPECT_EQ(next_step(at(10.5), target(10.5)), NextStep::event);
  EXPECT_EQ(next_step(at(11.0), target(11.0)), NextStep::event);
  EXPECT_EQ(next_step(at(11.2), target(11.5)), NextStep::keyframe) << "the one before comes first";
  EXPECT_EQ(next_step(at(10.5), target(7.0)), NextStep::event) << "a late one";
  OnlineProgress first = at(3.0);
  first.newest = -HUGE_VAL;
  EXPECT_EQ(next_step(first, target(3.0)), NextStep::event);
}

TEST(KeyframePolicy, TheChasersOwnMeasurementsWaitForTheKeyframeOfTheirInstant) {
  EXPECT_EQ(next_step(at(10.5), own(10.5)), NextStep::wait) << "the target may still be seen at 10.5 s";
  EXPECT_EQ(next_step(at(10.52), own(10.5)), NextStep::event);
  EXPECT_EQ(next_step(at(11.0), own(11.0)), NextStep::wait);
  EXPECT_EQ(next_step(at(11.02), own(11.0)), NextStep::keyframe);
  EXPECT_EQ(next_step(at(10.0), own(10.0)), NextStep::event) << "the keyframe is there";
  EXPECT_EQ(next_step(at(10.5), own(4.0)), NextStep::event);
  OnlineProgress alone = at(10.5);
  alone.target_may_come = false;
  EXPECT_EQ(next_step(alone, own(10.5)), NextStep::event);
  OnlineProgress short_of_it = at(10.9999);
  short_of_it.finished = true;
  EXPECT_EQ(next_step(short_of_it, own(10.9999)), NextStep::event) << "no keyframe will come";
}

TEST(KeyframePolicy, WithoutAnImuTheyMakeKeyframesOfTheirOwn) {
  OnlineProgress now = at(10.5);
  now.joins_earlier = false;
  EXPECT_EQ(next_step(now, own(10.5)), NextStep::event);
  EXPECT_EQ(next_step(now, own(10.6)), NextStep::wait);
  now.reached = now.last_motion = 11.0;
  EXPECT_EQ(next_step(now, own(11.0)), NextStep::event);
}

}  // namespace
}  // namespace tandem::detail
