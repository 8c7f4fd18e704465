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

TEST(OrnsteinUhlenbeck, gathers_the_noise_that_it_has_not_forgotten) {
  for (const double tau : {0.3, 5.0, 1e9}) {
    const OrnsteinUhlenbeck u{tau};
    const double t = 2.0;
    const int n = 20000;
    double integral = 0;  // ∫ exp(−2 s/τ) ds, by the midpoint rule
    for (int i = 0; i < n; ++i) integral += t / n * std::exp(-2 * (i + 0.5) * t / n / tau);
    EXPECT_NEAR(u.gathered(t), integral, 1e-7);
    EXPECT_NEAR(u.gathered(3 * t), u.gathered(t) + std::pow(u.kept(t), 2) * u.gathered(2 * t), 1e-12);
  }
  EXPECT_EQ((OrnsteinUhlenbeck{HUGE_VAL}.gathered(2.0)), 2.0);
  EXPECT_EQ((OrnsteinUhlenbeck{HUGE_VAL}.kept(2.0)), 1.0);
  EXPECT_NEAR((OrnsteinUhlenbeck{4.0}.gathered(1e3)), 2.0, 1e-12) << "the stationary variance, τ/2";
}

/// However the keyframes stand, the twist over the last interval has the variance of the process after the time that has
/// passed between the middles of the first and the last.
TEST(DampedTwist, its_noises_add_up_to_those_of_the_process) {
  const Vector<3> tau(2.0, 60.0, HUGE_VAL);
  for (const auto& steps : {std::vector{1.0, 1.0, 1.0, 1.0, 0.2, 0.8, 1.0}, std::vector{0.5, 4.0, 0.01, 2.0}}) {
    Vector<3> variance = Vector<3>::Zero();
    double passed = 0;
    for (std::size_t k = 1; k < steps.size(); ++k) {
      const auto residual = DampedTwist<R3>::over(steps[k - 1], steps[k], tau);
      const Vector<3> spread = DampedTwist<R3>::spread(steps[k - 1], steps[k], tau) / steps[k];
      variance = (residual.kept.cwiseAbs2().cwiseProduct(variance) + spread.cwiseAbs2()).eval();
      passed += 0.5 * (steps[k - 1] + steps[k]);
    }
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(variance[i], OrnsteinUhlenbeck{tau[i]}.gathered(passed), 1e-12);
  }
}

}  // namespace
}  // namespace tandem::testing
