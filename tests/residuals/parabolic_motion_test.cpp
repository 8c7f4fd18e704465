#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/residuals/parabolic_motion.hpp>

namespace tandem::testing {
namespace {

using detail::ParabolicMotion;

const SE3 here(SO3::Exp({0.3, -0.2, 2.9}), {5, -2, 3});

TEST(ParabolicMotion, PassesThroughTheThreeKeyframes) {
  const SE3 before = here * SE3::Exp((Vector<6>() << -1, 0.2, 0.1, 0.2, -0.1, 0.3).finished());
  const SE3 after = here * SE3::Exp((Vector<6>() << 2, 0.4, 0.3, -0.3, 0.1, 0.9).finished());
  const auto at = [&](double s) { return ParabolicMotion<SE3>({1.5, 0.8}, here, before, after, s, false).at; };
  EXPECT_LT(minus(at(0), here).norm(), 1e-14);
  EXPECT_LT(minus(at(-1.5), before).norm(), 1e-13);
  EXPECT_LT(minus(at(0.8), after).norm(), 1e-13);
}

TEST(ParabolicMotion, ReproducesConstantTwistAndStandsWithoutNeighbours) {
  const Vector<6> twist = (Vector<6>() << 1, 0.2, -0.1, 0.1, -0.3, 0.4).finished();
  const auto way = [&](double t) { return here * SE3::Exp(t * twist); };
  for (const NeighbourGaps& gaps : {NeighbourGaps{1.5, 0.8}, NeighbourGaps{1.5, 0}, NeighbourGaps{0, 0.8}})
    for (const double s : {-2.0, -0.3, 1e-9, 0.5, 1.7})
      EXPECT_LT(minus(ParabolicMotion<SE3>(gaps, here, way(-gaps.before), way(gaps.after), s, false).at, way(s)).norm(),
                1e-12);
  EXPECT_EQ(minus(ParabolicMotion<SE3>({}, here, SE3(), SE3(), 3.0, false).at, here).norm(), 0);
}

TEST(ParabolicMotion, ReproducesConstantAccelerationOfPoints) {
  const auto way = [](double t) { return R3(Vector<3>(1 + t + 0.5 * t * t, 2 - t * t, 3 * t)); };
  for (const double s : {-2.0, -0.3, 0.5, 1.7})
    EXPECT_LT((ParabolicMotion<R3>({1.0, 2.0}, way(0), way(-1), way(2), s, false).at.vector() - way(s).vector()).norm(),
              1e-13);
}

/// Noise of the keyframes has the same effect before and after the keyframe, so that it does not bias an estimated
/// time.
TEST(ParabolicMotion, NoiseIsSymmetricInTime) {
  const auto noise = [](double s) {
    const ParabolicMotion<R3> motion({1.0, 1.0}, R3(), R3(), R3(), s, true);
    return motion.by_here.squaredNorm() + motion.by_before.squaredNorm() + motion.by_after.squaredNorm();
  };
  for (const double s : {0.1, 0.4, 0.9}) EXPECT_NEAR(noise(s), noise(-s), 1e-14);
}

}  // namespace
}  // namespace tandem::testing
