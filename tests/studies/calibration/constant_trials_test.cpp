#include <random>

#include <gtest/gtest.h>

#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/with_bias.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/studies/calibration/constant_trials.hpp>

namespace tandem {
namespace {

using Number = Rn<1>;

/// A random walk measured by two sensors, the second one with a bias.
struct TwoSensors {
  Problem problem;
  std::vector<SensorConstant> constants;
  std::vector<std::vector<HeldOutMeasurement>> folds = std::vector<std::vector<HeldOutMeasurement>>(5);

  TwoSensors(unsigned seed, double bias) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    const Variable<Number> b = problem.add(Number(), "b.bias");
    problem.minimize(Prior<Number>{Number()}, {5.0}, {b});
    constants.push_back({"b.bias", b, Vector<1>(5.0)});
    std::optional<Variable<Number>> before;
    double truth = 0;
    for (std::size_t k = 0; k < 200; ++k, truth += 0.3 * normal(random)) {
      const auto x = problem.add(Number());
      if (before) problem.minimize(RelativePose<Number>{Number()}, {0.3}, {*before, x});
      before = x;
      const Prior<Number> z{Number(Vector<1>(truth + normal(random)))};
      folds[k / 10 % 5].push_back({problem.minimize(z, {1.0}, {x})});
      const WithBias<Prior<Number>> z_b{{Number(Vector<1>(truth + bias + normal(random)))}};
      folds[k / 10 % 5].push_back({problem.minimize(z_b, {1.0}, {x, b})});
    }
  }
  double value() const { return problem.value(std::get<Variable<Number>>(constants[0].state)).vector()[0]; }
};

TEST(ConstantTrials, OnlyATrueBiasImprovesThePrediction) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    TwoSensors with(seed, 1.0), without(seed, 0.0);
    const ConstantTrials found = cross_validate_constants(with.problem, with.constants, with.folds);
    ASSERT_EQ(found.trials.size(), 1u) << found.why;
    EXPECT_EQ(found.trials[0].name, "b.bias");
    EXPECT_GT(found.trials[0].gain, 3 * found.trials[0].gain_error);
    const ConstantTrials none = cross_validate_constants(without.problem, without.constants, without.folds);
    ASSERT_EQ(none.trials.size(), 1u) << none.why;
    EXPECT_LT(none.trials[0].gain, 2 * none.trials[0].gain_error);
    EXPECT_LT(std::abs(none.trials[0].gain), 5) << "an unnecessary constant costs little";
  }
}

TEST(ConstantTrials, LeaveTheProblemUnchanged) {
  TwoSensors run(1, 1.0);
  const double cost = solve(run.problem, GaussNewtonOptions{}).cost, value = run.value();
  cross_validate_constants(run.problem, run.constants, run.folds);
  EXPECT_NEAR(run.value(), value, 1e-9);
  EXPECT_NEAR(solve(run.problem, GaussNewtonOptions{}).cost, cost, 1e-9 * cost);
  EXPECT_FALSE(run.problem.is_fixed(std::get<Variable<Number>>(run.constants[0].state)));
}

TEST(ConstantTrials, ThrowOnAStopAndLeaveTheProblemUnchanged) {
  TwoSensors run(1, 1.0);
  const double cost = solve(run.problem, GaussNewtonOptions{}).cost;
  const std::atomic<bool> stop = true;
  CalibrationOptions options;
  options.stop = Stop(&stop);
  EXPECT_THROW(cross_validate_constants(run.problem, run.constants, run.folds, options), Stopped);
  EXPECT_NEAR(solve(run.problem, GaussNewtonOptions{}).cost, cost, 1e-9 * cost);
}

}  // namespace
}  // namespace tandem
