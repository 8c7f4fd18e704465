#include <cmath>

#include <gtest/gtest.h>

#include <tandem/problem/tracking/heading_axes.hpp>

namespace tandem::testing {
namespace {

constexpr std::size_t kKeyframes = 200;

/// A target that hardly moves: its position oscillates along the direction `angle`.
struct Oscillation {
  explicit Oscillation(double angle, double drift = 0) {
    for (std::size_t k = 0; k < kKeyframes; ++k) {
      const double t = double(k), x = 0.3 * std::sin(0.8 * t);
      keyframes.push_back({t, KeyframeType::none, {}, {}});
      track.position.push_back({x * std::cos(angle) + drift * t, x * std::sin(angle), 0});
      track.velocity.push_back(Vector<3>::Zero());
    }
    noise.constant_twist = Vector<6>(0.15, 0.05, 0.05, 0.02, 0.02, 0.06);
  }
  std::vector<double> headings(double before, double after, const TrackingOptions& options = {}) const {
    const detail::HeadingAxes axes = detail::heading_axes(keyframes, track, noise, options);
    return detail::follow_axes(keyframes, track, axes, 1, kKeyframes - 1, before, after);
  }
  std::vector<Keyframe> keyframes;
  detail::SmoothedTrack track;
  TrackingNoise noise;
};

TEST(HeadingAxes, SurgeLiesAlongTheAcceleration) {
  const std::vector<double> found = Oscillation(0.5).headings(0.6, 0.4);
  ASSERT_EQ(found.size(), kKeyframes - 2);
  EXPECT_NEAR(found[100], 0.5, 1e-3);
  EXPECT_NEAR(found.front(), 0.6, 0.05);
  EXPECT_NEAR(found.back(), 0.4, 0.05);
}

TEST(HeadingAxes, SurgeLiesAcrossTheAccelerationIfSwayHasMoreNoise) {
  Oscillation o(0.5);
  o.noise.constant_twist = Vector<6>(0.05, 0.15, 0.05, 0.02, 0.02, 0.06);
  EXPECT_NEAR(std::abs(std::remainder(o.headings(2.0, 2.0)[100] - 0.5, 3.14159265)), 1.5708, 1e-3);
}

TEST(HeadingAxes, TurnsByHalfATurnIfBothEndsRequireIt) {
  const std::vector<double> found = Oscillation(0.5).headings(0.5, 0.5 + 3.1);
  EXPECT_NEAR(found.front(), 0.5, 0.05);
  EXPECT_NEAR(std::abs(found.back() - 0.5), 3.1, 0.05);
}

TEST(HeadingAxes, AreNotUsedForEqualNoiseOrAMovingTarget) {
  Oscillation o(0.5);
  o.noise.constant_twist.setConstant(0.05);
  EXPECT_TRUE(o.headings(0.6, 0.4).empty());
  EXPECT_TRUE(Oscillation(0.5, 2.0).headings(0.6, 0.4).empty());
}

TEST(HeadingAxes, FollowTheVelocityOfANonHolonomicTarget) {
  Oscillation o(0.5);
  o.noise.constant_twist.setConstant(0.05);
  EXPECT_NEAR(o.headings(0.6, 0.4, {.non_holonomic = Role::soft})[100], 0.5, 1e-3);
}

}  // namespace
}  // namespace tandem::testing
