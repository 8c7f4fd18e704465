#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>

#include "residuals/damped_twist_checks.hpp"

namespace tandem::testing {
namespace {

INSTANTIATE_TYPED_TEST_SUITE_P(SE3, DampedTwistTest, SE3);
INSTANTIATE_TYPED_TEST_SUITE_P(SE2, DampedTwistTest, SE2);
INSTANTIATE_TYPED_TEST_SUITE_P(R3, DampedTwistTest, R3);

TEST(OrnsteinUhlenbeck, UnitVarianceMatchesItsIntegral) {
  for (const double tau : {0.3, 5.0, 1e9}) {
    const OrnsteinUhlenbeck u{tau};
    const double t = 2.0;
    const int n = 20000;
    double integral = 0;  // ∫ exp(−2 s/τ) ds, by the midpoint rule
    for (int i = 0; i < n; ++i) integral += t / n * std::exp(-2 * (i + 0.5) * t / n / tau);
    EXPECT_NEAR(u.unit_variance(t), integral, 1e-7);
    EXPECT_NEAR(u.unit_variance(3 * t), u.unit_variance(t) + std::pow(u.decay(t), 2) * u.unit_variance(2 * t), 1e-12);
  }
  EXPECT_EQ((OrnsteinUhlenbeck{HUGE_VAL}.unit_variance(2.0)), 2.0);
  EXPECT_EQ((OrnsteinUhlenbeck{HUGE_VAL}.decay(2.0)), 1.0);
  EXPECT_NEAR((OrnsteinUhlenbeck{4.0}.unit_variance(1e3)), 2.0, 1e-12) << "stationary variance τ/2";
}

/// For any keyframe times, the twist over the last interval has the variance of the process after the time between the
/// middles of the first and the last interval.
TEST(DampedTwist, NoiseAccumulatesToThatOfTheProcess) {
  const Vector<3> tau(2.0, 60.0, HUGE_VAL);
  for (const auto& steps : {std::vector{1.0, 1.0, 1.0, 1.0, 0.2, 0.8, 1.0}, std::vector{0.5, 4.0, 0.01, 2.0}}) {
    Vector<3> variance = Vector<3>::Zero();
    double passed = 0;
    for (std::size_t k = 1; k < steps.size(); ++k) {
      const auto residual = DampedTwist<R3>::over(steps[k - 1], steps[k], tau);
      const Vector<3> sigma = DampedTwist<R3>::noise_scale(steps[k - 1], steps[k], tau) / steps[k];
      variance = (residual.decay.cwiseAbs2().cwiseProduct(variance) + sigma.cwiseAbs2()).eval();
      passed += 0.5 * (steps[k - 1] + steps[k]);
    }
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(variance[i], OrnsteinUhlenbeck{tau[i]}.unit_variance(passed), 1e-12);
  }
}

}  // namespace
}  // namespace tandem::testing
