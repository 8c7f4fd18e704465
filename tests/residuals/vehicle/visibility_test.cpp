#include <gtest/gtest.h>

#include <tandem/residuals/vehicle/visibility.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

Visibility mounted_camera() {
  return Visibility{{8.0, 0.7, 0.6, 0.08, SE3(SO3::Exp({0.1, -0.3, 0.4}), {0.5, 0.1, -0.2}), {-0.8, 0.0, 0.3}}};
}

TEST(Visibility, ProbabilityIsOneHalfAtTheLimits) {
  const Visibility visibility;
  const auto probability = [&](double x, double y) { return visibility.probability(Vector<3>(x, y, 0.0)); };
  EXPECT_GT(probability(3.0, 0.0), 0.99);
  EXPECT_NEAR(probability(9.0, 0.0), 0.5, 0.01);
  EXPECT_LT(probability(15.0, 0.0), 0.01);
  EXPECT_NEAR(probability(3.0, 3.0), 0.5, 0.01);  // 45° off
  EXPECT_LT(probability(-3.0, 0.0), 1e-9);        // behind
  Vector<1> r;
  visibility(SE3(), SE3(SO3(), {9.0, 0.0, 0.0}), Rn<1>(Vector<1>(2.0)), r);
  EXPECT_NEAR(0.5 * r[0] * r[0], -2.0 * std::log(probability(9.0, 0.0)), 1e-12);
}

TEST(Visibility, HasCorrectJacobians) {
  const Visibility visibility = mounted_camera();
  const SE3 c(SO3::Exp({0.3, -0.2, 2.9}), {3.0, -2.0, 1.0});
  for (const double x : {0.0, 0.5, 4.0, 8.0, 20.0, -5.0})
    for (const double y : {0.0, 3.0})
      for (const double angle : {0.0, 1e-8, 1.0, std::numbers::pi - 1e-6}) {
        const SE3 t = c * SE3(SO3::Exp({0.0, angle, 0.0}), {x, y, 0.3});
        const Rn<1> g(Vector<1>(1.3));
        EXPECT_LE(autodiff_error(visibility, c, t, g), kAutodiff) << x << ", " << y << ", " << angle;
        expect_correct(check_jacobians(visibility, c, t, g));
      }
}

/// Unlike 1 − P, the cost has a gradient far away and outside the field of view, so that a plan can improve from there.
TEST(Visibility, HasGradientOutOfSight) {
  const Visibility visibility;
  const auto cost = [&](double x, double y) {
    Vector<1> r;
    visibility(SE3(), SE3(SO3(), {x, y, 0.0}), Rn<1>(Vector<1>(1.0)), r);
    return r[0] * r[0];
  };
  EXPECT_NEAR(cost(51.0, 0.0) - cost(50.0, 0.0), 1.0, 1e-3);        // one range_fade
  EXPECT_NEAR(cost(-3.0, 4.0) - cost(0.0, 5.0), 0.6 / 0.05, 1e-3);  // change of the cosine over cosine_fade
  for (const double x : {3.0, 9.0, 12.0}) EXPECT_GE(cost(x, 1.0), 1.0 - visibility.probability(Vector<3>(x, 1.0, 0.0)));
}

TEST(Visibility, ProbabilityHasCorrectDerivative) {
  const Visibility visibility = mounted_camera();
  for (const Vector<3>& p : {Vector<3>(4.0, 1.0, -0.5), Vector<3>(8.5, -2.0, 3.0), Vector<3>(0.0, 0.0, 0.0)}) {
    Matrix<1, 3> by_p;
    visibility.probability(p, &by_p);
    for (int i = 0; i < 3; ++i) {
      const Vector<3> step = 1e-6 * Vector<3>::Unit(i);
      const double slope =
          (visibility.probability(Vector<3>(p + step)) - visibility.probability(Vector<3>(p - step))) / 2e-6;
      EXPECT_NEAR(by_p[i], slope, 1e-6);
    }
  }
}

TEST(Visibility, IsZeroWithZeroJacobianIfProbabilityRoundsToOne) {
  Visibility visibility;
  visibility.sight.range_fade = visibility.sight.cosine_fade = 1e-4;
  Vector<1> r;
  Matrix<1, 6> J;
  visibility(SE3(), SE3(SO3(), {1.0, 0.0, 0.0}), Rn<1>(Vector<1>(1.0)), r, &J);
  EXPECT_EQ(r[0], 0.0);
  EXPECT_EQ(J.norm(), 0.0);
}

}  // namespace
}  // namespace tandem::testing
