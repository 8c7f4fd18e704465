#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/calibration/misfit.hpp>

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

/// Returns standardised residuals with a mean of `offset`. `correlated` is the standard deviation of a Gauss-Markov
/// error with correlation time `time_constant` [s]; white noise makes up the rest.
Misfit made_of(double correlated, double time_constant, double offset, const std::string& component = "rz",
               bool angle = true) {
  Misfit m{{}, "here", "camera." + component, component, angle};
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const double keep = time_constant > 0 ? std::exp(-0.5 / time_constant) : 0;
  double error = correlated * normal(random);
  for (int i = 0; i < 800; ++i) {
    m.t.push_back(0.5 * i);
    m.value.push_back(offset + error + std::sqrt(1 - correlated * correlated) * normal(random));
    error = keep * error + std::sqrt(1 - keep * keep) * correlated * normal(random);
  }
  return m;
}

TEST(Misfit, DiagnosesNothingForWhiteNoise) {
  const Misfit m = made_of(0, 0, 0);
  EXPECT_NEAR(m.mean(), 0, 0.1);
  EXPECT_NEAR(m.standard_deviation(), 1, 0.1);
  EXPECT_EQ(m.correlation_time(), 0);
  EXPECT_FALSE(m.has_significant_mean());
  EXPECT_THAT(m.diagnosis(), IsEmpty());
}

TEST(Misfit, DiagnosesTimeCorrelatedErrors) {
  const Misfit m = made_of(1, 20, 0);
  EXPECT_EQ(m.spacing(), 0.5);
  EXPECT_GT(m.correlation_time(), 8);
  EXPECT_LT(m.correlation_time(), 50);
  EXPECT_THAT(m.diagnosis(), HasSubstr("camera.rz has time-correlated errors"));
  EXPECT_THAT(m.diagnosis(), HasSubstr("drifting misalignment"));
}

TEST(Misfit, DiagnosesAMeanByComponent) {
  EXPECT_THAT(made_of(0, 0, 1.5).diagnosis(),
              HasSubstr("mean of +1.5 standard deviations; possible cause: a mounting misalignment"));
  EXPECT_THAT(made_of(0, 0, -1.5, "range", false).diagnosis(), HasSubstr("sound speed"));
  EXPECT_THAT(made_of(0, 0, 1.5, "x", false).diagnosis(), HasSubstr("wrong position of the sensor"));
}

TEST(Misfit, PoolsAutocorrelationsOverScenarios) {
  const Misfit a = made_of(1, 20, 0);
  Misfit b = a;
  b.scenario = "there";
  const auto of = autocorrelations({a, b}, 5);
  ASSERT_EQ(of.size(), 1u);
  ASSERT_EQ(of[0].values.size(), 6u);
  EXPECT_NEAR(of[0].values[0], 1, 1e-9);
  EXPECT_NEAR(of[0].values[1], a.correlation(), 0.01);
}

}  // namespace
}  // namespace tandem
