#include <cmath>

#include <gtest/gtest.h>

#include <tandem/problem/tracking/orientation_guess.hpp>
#include <tandem/problem/tracking/planar.hpp>

namespace tandem::testing {
namespace {

using detail::OrientationFix;

/// Track along x at `speed`, whose measured direction jitters by `jitter` m/s with the standard deviation 0.1 m/s.
struct Track {
  explicit Track(double speed, double jitter) {
    for (int k = 0; k < 40; ++k) {
      keyframes.push_back({double(k), KeyframeType::none, {}, {}});
      track.position.push_back(Vector<3>(speed * k, jitter * std::sin(7.0 * k), 0));
      track.velocity.push_back(Vector<3>(speed + jitter * std::cos(5.0 * k), jitter * std::sin(5.0 * k), 0));
      track.velocity_variance.push_back(0.01);
    }
  }
  std::vector<double> headings(const std::vector<OrientationFix>& fixes) const {
    std::vector<double> found;
    for (const SO3& R : detail::guess_orientations(keyframes, track, fixes, 2.0)) found.push_back(heading(R));
    return found;
  }
  std::vector<Keyframe> keyframes;
  detail::SmoothedTrack track;
};

SO3 turned(double angle) { return SO3::Exp({0, 0, angle}); }

TEST(OrientationGuess, FollowsTheCourse) {
  for (const double h : Track(1.0, 0.05).headings({})) EXPECT_NEAR(h, 0, 0.1);
}

/// The course of a target that stands is noise.
TEST(OrientationGuess, IsConstantForATargetThatStands) {
  const std::vector<double> found = Track(0.0, 0.2).headings({});
  for (const double h : found) EXPECT_EQ(h, found[0]);
}

TEST(OrientationGuess, InterpolatesBetweenFixesOfATargetThatStands) {
  const std::vector<double> found = Track(0.0, 0.2).headings({{5.0, turned(0.2)}, {35.0, turned(0.8)}});
  EXPECT_NEAR(found[0], 0.2, 1e-12);
  EXPECT_NEAR(found[20], 0.5, 0.02);
  EXPECT_NEAR(found[39], 0.8, 1e-12);
}

TEST(OrientationGuess, GoesAsternIfTheFixesDo) {
  for (const double h : Track(1.0, 0.05).headings({{5.0, turned(3.0)}, {35.0, turned(-3.0)}}))
    EXPECT_GT(std::abs(h), 2.9);
}

}  // namespace
}  // namespace tandem::testing
