#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/fit_report.hpp>
#include <tandem/solvers/gauss_newton.hpp>

namespace tandem {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Points measured twice each, with the stated noise times `factor` and every `period`-th measurement off by 50 m.
struct Measured {
  Problem problem;
  std::vector<MeasurementBlock> blocks;
  FitReport fit;

  explicit Measured(double factor, const Loss& loss = {}, int period = 0, bool with_marginals = true) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    const double sigma = 0.3;
    for (int i = 0; i < 1000; ++i) {
      const auto x = problem.add(R3());
      for (int part = 0; part < 2; ++part) {
        Vector<3> z{normal(random), normal(random), normal(random)};
        z *= factor * sigma;
        if (period > 0 && part == 0 && i % period == 0) z.x() += 50;
        const Block block = problem.minimize(Prior<R3>{R3(z)}, Gaussian({sigma, sigma, sigma}), {x}, loss);
        blocks.push_back({0, double(i), block});
      }
    }
    EXPECT_TRUE(solve(problem, GaussNewtonOptions{}).converged());
    const JudgedSensor sensor{"gps", {"x", "y", "z"}};
    if (with_marginals) {
      const Marginals marginals(problem);
      fit = fit_report(problem, {sensor}, blocks, &marginals);
    } else {
      fit = fit_report(problem, {sensor}, blocks);
    }
  }
};

TEST(FitReport, AcceptsStatedNoise) {
  for (const bool with_marginals : {true, false}) {
    const Measured m(1, {}, 0, with_marginals);
    EXPECT_TRUE(m.fit.consistent()) << m.fit.verdict();
    EXPECT_DOUBLE_EQ(m.fit.expected_cost, 1500);  // ½ (6000 rows − 3000 unknowns)
    EXPECT_NEAR(m.fit.cost, 1500, 3 * m.fit.cost_sigma);
    for (const ResidualSeries& s : m.fit.sensors[0].series) {
      EXPECT_EQ(s.value.size(), 2000u);
      EXPECT_NEAR(s.standard_deviation(), 1, 0.05);
      EXPECT_NEAR(s.mean(), 0, 0.05);
    }
    EXPECT_EQ(m.fit.sensors[0].worst.size(), 5u);
  }
}

TEST(FitReport, AccountsForRobustLosses) {
  const Measured m(1, Cauchy(2.0));
  EXPECT_TRUE(m.fit.consistent()) << m.fit.verdict();
  EXPECT_NEAR(m.fit.cost / m.fit.expected_cost, 1, 0.2);  // the unknowns' share is approximate
}

TEST(FitReport, NamesTheMisfit) {
  const Measured m(4);
  EXPECT_FALSE(m.fit.consistent());
  EXPECT_THAT(m.fit.verdict(), HasSubstr("gps: residuals of "));
  EXPECT_NEAR(m.fit.sensors[0].series[0].rms(), 4, 0.3);
}

/// A smooth walk with exact measurements: the walk needs a hundredth of its stated noise.
TEST(FitReport, NamesNoiseThatIsFarTooLarge) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  Problem problem;
  std::vector<MeasurementBlock> blocks;
  std::vector<NoiseOfBlock> noises;
  std::optional<Variable<R3>> last;
  Vector<3> truth = Vector<3>::Zero();
  for (int i = 0; i < 300; ++i) {
    truth += 0.05 * Vector<3>{normal(random), normal(random), normal(random)};
    const auto x = problem.add(R3());
    const Vector<3> noise{normal(random), normal(random), normal(random)};
    blocks.push_back(
        {0, double(i), problem.minimize(Prior<R3>{R3(truth + 0.01 * noise)}, Gaussian({0.01, 0.01, 0.01}), {x})});
    if (last)
      noises.push_back({"walk", problem.minimize(RelativePose<R3>{R3()}, Gaussian({5.0, 5.0, 5.0}), {*last, x})});
    last = x;
  }
  ASSERT_TRUE(solve(problem, GaussNewtonOptions{}).converged());
  const Marginals marginals(problem);
  const FitReport fit = fit_report(problem, {{"gps", {"x", "y", "z"}}}, blocks, &marginals, noises);
  EXPECT_TRUE(fit.consistent());
  EXPECT_TRUE(fit.noise_is_far_too_large());
  ASSERT_EQ(fit.noises.size(), 1u);
  for (const double rms : fit.noises[0].rms) EXPECT_NEAR(rms, 0.01, 0.002);
  EXPECT_THAT(fit.verdict(), HasSubstr("NOISE FAR TOO LARGE"));
  EXPECT_THAT(fit.verdict(), HasSubstr("Too large: walk by a factor of "));
}

TEST(FitReport, NamesTheWorstMeasurements) {
  const Measured m(1, {}, 250);
  std::vector<double> t;
  for (const WorstMeasurement& w : m.fit.sensors[0].worst) t.push_back(w.t);
  EXPECT_THAT(std::vector<double>(t.begin(), t.begin() + 4), ::testing::UnorderedElementsAre(0, 250, 500, 750));
  EXPECT_GT(std::abs(m.fit.sensors[0].worst[3].residual), 50);
}

TEST(FitReport, CountsContestedMeasurements) {
  // A third measurement agrees with the second, so the loss rejects the first.
  Problem problem;
  std::vector<MeasurementBlock> blocks;
  for (int i = 0; i < 100; ++i) {
    const auto x = problem.add(Rn<1>());
    for (const double z : {i % 4 == 0 ? 30.0 : 0.0, 0.0, 0.0})
      blocks.push_back(
          {0, double(i), problem.minimize(Prior<Rn<1>>{Rn<1>(Vector<1>(z))}, Gaussian({1.0}), {x}, Cauchy(3.0))});
  }
  ASSERT_TRUE(solve(problem, GaussNewtonOptions{}).converged());
  const FitReport fit = fit_report(problem, {{"range", {"range"}, std::vector<double>(30, 7.0)}}, blocks);
  EXPECT_EQ(fit.sensors[0].down_weighted, 25);
  EXPECT_EQ(fit.sensors[0].rejected, 30);
  EXPECT_EQ(fit.sensors[0].rejected_at, std::vector<double>(30, 7.0));
  EXPECT_EQ(fit.sensors[0].series[0].t.size(), 275u);
  EXPECT_EQ(fit.sensors[0].down_weighted_series[0].t.size(), 25u);
  EXPECT_THAT(fit.sensors[0].misfit(), HasSubstr("55 of 330 measurements"));
}

TEST(FitReport, IgnoresFixedVariables) {
  Problem problem;
  const auto x = problem.add(R3());
  problem.minimize(Prior<R3>{R3(Vector<3>(100, 0, 0))}, Gaussian({1, 1, 1}), {x});
  problem.fix(x);
  EXPECT_EQ(fit_report(problem, {}, {}).expected_cost, 0);
}

TEST(FitReport, DoesNotJudgeWithoutRedundancy) {
  Problem problem;
  const auto x = problem.add(R3());
  problem.minimize(Prior<R3>{R3(Vector<3>(0.1, 0, 0))}, Gaussian{1.0, 1.0, 1.0}, {x});
  const FitReport fit = fit_report(problem, {}, {});
  EXPECT_GT(fit.cost, 0);
  EXPECT_TRUE(fit.consistent());
  EXPECT_THAT(fit.verdict(), HasSubstr("cannot be judged"));
}

TEST(LossExpectation, AgreesWithSampling) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (const Loss& loss : {Huber(1.0), Cauchy(2.0), GemanMcClure(2.0), Tukey(4.0), StudentT(3, 3)}) {
    double sum = 0, down = 0;
    constexpr int kSamples = 200000;
    for (int i = 0; i < kSamples; ++i) {
      const double s = Vector<3>{normal(random), normal(random), normal(random)}.squaredNorm();
      sum += 0.5 * loss(s).rho / kSamples;
      down += (loss(s).d1 < kDownweightThreshold) / double(kSamples);
    }
    const detail::LossExpectation e = detail::loss_expectation(loss, 3);
    EXPECT_NEAR(e.half_rho, sum, 0.01);
    EXPECT_NEAR(e.down_weighted, down, 0.005);
  }
  EXPECT_DOUBLE_EQ(detail::loss_expectation(Loss{}, 3).half_rho, 1.5);
}

}  // namespace
}  // namespace tandem
