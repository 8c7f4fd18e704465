#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <tandem/studies/study/constant_velocity_filter.hpp>

namespace tandem {
namespace {

constexpr double kNoDecay = std::numeric_limits<double>::infinity();
const Matrix<3, 3> kExact = 1e-8 * Matrix<3, 3>::Identity();

/// Exact fixes of a uniform motion determine the velocity, so predictions are exact too.
TEST(ConstantVelocityFilter, PredictsUniformMotion) {
  ConstantVelocityFilter filter(0.2, kNoDecay);
  EXPECT_FALSE(filter.started());
  const Vector<3> from(1, 2, 3), velocity(0.5, -0.2, 0.1);
  for (int t = 10; t <= 20; ++t) filter.update(t, from + t * velocity, kExact);
  EXPECT_TRUE(filter.started());
  EXPECT_LT((filter.position() - (from + 20 * velocity)).norm(), 1e-3);
  EXPECT_LT((filter.position(5) - (from + 25 * velocity)).norm(), 1e-3);
  filter.predict(23);
  EXPECT_LT((filter.position() - (from + 23 * velocity)).norm(), 1e-3);
}

/// With velocity decay, the predicted distance is v τ (1 − exp(−t / τ)).
TEST(ConstantVelocityFilter, VelocityDecaysWithItsTimeConstant) {
  ConstantVelocityFilter keeps(0.2, kNoDecay), forgets(0.2, 10);
  for (ConstantVelocityFilter* filter : {&keeps, &forgets})
    for (int k = 0; k <= 100; ++k) filter->update(0.1 * k, Vector<3>(0.1 * k, 0, 0), kExact);
  EXPECT_NEAR(keeps.position(1e4).x(), 1e4, 300);
  EXPECT_NEAR(forgets.position(1e4).x() - forgets.position().x(), 10, 0.3);
  EXPECT_NEAR(forgets.position(10).x() - forgets.position().x(), 10 * (1 - std::exp(-1.0)), 0.2);
}

/// The filter weights fixes by the inverse of their covariance.
TEST(ConstantVelocityFilter, WeightsFixesByTheirCovariance) {
  ConstantVelocityFilter filter(1e-6, kNoDecay);
  filter.update(0, Vector<3>::Zero(), kExact);  // the initial σ is 3 m
  filter.update(0, Vector<3>(1, 0, 0), 9 * Matrix<3, 3>::Identity());
  EXPECT_NEAR(filter.position().x(), 0.5, 1e-12);
  filter.update(0, Vector<3>(1, 0, 0), 4.5 * Matrix<3, 3>::Identity());
  EXPECT_NEAR(filter.position().x(), 0.75, 1e-12);
}

}  // namespace
}  // namespace tandem
