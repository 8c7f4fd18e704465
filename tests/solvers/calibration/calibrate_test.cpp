#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/calibration/calibrate.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>
#include <tandem/solvers/gauss_newton.hpp>

#include "walk.hpp"

/// Tests against the exact evidence of linear Gaussian problems, computed with dense matrices.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;

TEST(Calibrate, ReachesTheMaximumOfTheEvidence) {
  Walk walk(2);
  walk.given_step_sigma = 5, walk.given_fix_sigma = 0.1;
  walk.build();
  const Calibration found = calibrate(walk.problem, {walk.steps, walk.fixes});
  ASSERT_TRUE(found.converged()) << found.message;
  const double a = std::log(found.noise[0].factor), b = std::log(found.noise[1].factor), h = 1e-3;
  Eigen::Matrix2d H;
  const auto f = [&](double x, double y) { return walk.exact(a + x * h, b + y * h); };
  H << f(1, 0) - 2 * f(0, 0) + f(-1, 0), (f(1, 1) - f(1, -1) - f(-1, 1) + f(-1, -1)) / 4, 0,
      f(0, 1) - 2 * f(0, 0) + f(0, -1);
  H(1, 0) = H(0, 1);
  const Eigen::Matrix2d covariance = (-H / (h * h)).inverse();
  const Eigen::Vector2d off = covariance * Eigen::Vector2d(f(1, 0) - f(-1, 0), f(0, 1) - f(0, -1)) / (2 * h);
  EXPECT_LE(off.cwiseAbs().maxCoeff(), 2e-3) << "Newton step of the exact evidence";
  EXPECT_LE((found.log_covariance - covariance).cwiseAbs().maxCoeff(), 0.02 * covariance.cwiseAbs().maxCoeff());
  EXPECT_NEAR(5 * found.noise[0].factor, walk.step_sigma, 0.15 * walk.step_sigma);
  EXPECT_NEAR(0.1 * found.noise[1].factor, walk.fix_sigma, 0.15 * walk.fix_sigma);
  EXPECT_NEAR(found.gain, walk.exact(a, b) - walk.exact(0, 0), 1e-6 * std::abs(found.gain));
  EXPECT_TRUE(found.noise[0].identifiable && found.noise[1].identifiable);
  EXPECT_LE(found.iterations, 20);
  EXPECT_EQ(found.noise[1].rows, 300);
}

TEST(Calibrate, StandardErrorsHaveTheRightCoverage) {
  int within = 0, of = 0;
  double sum = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    Walk walk(100 + seed, 150);
    walk.build();
    const Calibration found = calibrate(walk.problem, {walk.steps, walk.fixes});
    ASSERT_TRUE(found.converged());
    const double truth[] = {walk.step_sigma, walk.fix_sigma};
    for (int g : {0, 1}) {
      const double off = std::log(found.noise[std::size_t(g)].factor / truth[g]);
      within += std::abs(off) <= 2 * found.noise[std::size_t(g)].log_error;
      sum += off;
      ++of;
    }
  }
  EXPECT_GE(within, 0.88 * of);
  EXPECT_LE(std::abs(sum / of), 0.05);
}

TEST(Calibrate, EstimatesAFactorSharedBySeveralProblems) {
  Walk one(7, 150), two(8, 150);
  one.build();
  two.build();
  Problem* const both[] = {&one.problem, &two.problem};
  NoiseGroup steps = one.steps, fixes = one.fixes;
  for (NoiseRows rows : two.steps.rows) rows.problem = 1, steps.rows.push_back(rows);
  for (NoiseRows rows : two.fixes.rows) rows.problem = 1, fixes.rows.push_back(rows);
  const Calibration found = calibrate(both, {steps, fixes});
  ASSERT_TRUE(found.converged());
  const double a = std::log(found.noise[0].factor), b = std::log(found.noise[1].factor), h = 1e-3;
  const auto f = [&](double x, double y) { return one.exact(a + x * h, b + y * h) + two.exact(a + x * h, b + y * h); };
  const double curvature = (f(0, 1) - 2 * f(0, 0) + f(0, -1)) / (h * h);
  EXPECT_LE(std::abs((f(0, 1) - f(0, -1)) / (2 * h) / curvature), 2e-3);
  EXPECT_EQ(found.noise[0].rows, 298);
}

TEST(Calibrate, RobustLossesLimitTheEffectOfOutliers) {
  Walk plain(5, 300, 0.05), bounded(5, 300, 0.05), rejecting(5, 300, 0.05);
  plain.build();
  bounded.build(Cauchy(2));
  rejecting.build(Tukey(4));
  EXPECT_GE(calibrate(plain.problem, {plain.fixes}).noise[0].factor, 10);
  EXPECT_LE(calibrate(bounded.problem, {bounded.fixes}).noise[0].factor, 1.5)
      << "the loss bounds each outlier to 4, of 0.66 counted rows";
  EXPECT_NEAR(calibrate(rejecting.problem, {rejecting.fixes}).noise[0].factor, 1, 0.25);
}

TEST(StatisticalCalibrate, RobustLossesDoNotBiasNormalNoise) {
  const auto mean_log_factor = [](const Loss& loss) {
    constexpr int seeds = 10;
    double sum = 0;
    for (unsigned seed = 0; seed < seeds; ++seed) {
      Walk walk(seed);
      walk.build(loss);
      sum += std::log(calibrate(walk.problem, {walk.steps, walk.fixes}).noise[1].factor);
    }
    return sum / seeds;
  };
  const double plain = mean_log_factor({});
  for (const Loss& loss : {Huber(1.5), Cauchy(2), GemanMcClure(4), Tukey(4)})
    EXPECT_NEAR(mean_log_factor(loss), plain, 0.1) << int(loss.kind);
}

TEST(Calibrate, KeepsAFactorThatIsNotIdentifiable) {
  Walk walk(6, 100);
  walk.build();
  // One row that reads an extra state: the evidence does not depend on its sigma.
  const auto bias = walk.problem.add(Number());
  NoiseGroup alone{"alone", {{walk.problem.minimize(Prior<Number>{Number()}, {0.3}, {bias})}}, 1.0};
  const Calibration found = calibrate(walk.problem, {walk.steps, alone, walk.fixes});
  ASSERT_TRUE(found.converged());
  EXPECT_FALSE(found.noise[1].identifiable);
  EXPECT_EQ(found.noise[1].factor, 1);
  EXPECT_NEAR(found.noise[1].flat_from, 0.1, 1e-3);
  EXPECT_NEAR(found.noise[1].flat_to, 10, 0.1);
  EXPECT_TRUE(found.noise[0].identifiable && found.noise[2].identifiable);
  EXPECT_LT(found.noise[2].flat_from, found.noise[2].factor);
  EXPECT_GT(found.noise[2].flat_to, found.noise[2].factor);
}

/// A failed solve does not bound a range, and the values that it leaves are reset.
TEST(Calibrate, FailedSolvesDoNotBoundARange) {
  Walk walk(6, 100);
  walk.build();
  const auto bias = walk.problem.add(Number());
  const Block row = walk.problem.minimize(Prior<Number>{Number()}, {0.3}, {bias});
  CalibrationOptions options;
  options.solve = [&](Problem& problem) {
    if (std::abs(std::log(problem.noise(row).covariance_matrix()(0, 0) / (0.3 * 0.3))) < 1) return solve(problem, {});
    problem.set_value(problem.counterpart(bias), Number(Vector<1>(1e3)));
    return Summary();
  };
  const Calibration found = calibrate(walk.problem, {{"alone", {{row}}, 1.0}, walk.fixes}, options);
  ASSERT_TRUE(found.converged()) << found.message;
  EXPECT_FALSE(found.noise[0].identifiable || found.noise[0].bounded);
  EXPECT_EQ(found.noise[0].factor, 1);
  EXPECT_TRUE(found.noise[1].identifiable);
  EXPECT_NEAR(walk.problem.value(bias).vector()[0], 0, 1e-9);
}

/// All solves after the first one fail, for arbitrarily small changes of the noise.
TEST(Calibrate, ThrowsIfNoStepCanBeSolved) {
  Walk walk(6, 100);
  walk.given_fix_sigma = 3;
  walk.build();
  CalibrationOptions options;
  int solves = 0;
  options.solve = [&](Problem& problem) {
    Summary summary = ++solves == 1 ? solve(problem, {}) : Summary();
    if (solves > 1) summary.message = "the sky fell";
    return summary;
  };
  try {
    calibrate(walk.problem, {walk.fixes}, options);
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("cannot be solved with noise near the current estimate: the sky fell"));
  }
}

/// A solver that reports a higher cost at each call: no step increases the evidence.
TEST(Calibrate, AFailedLineSearchIsAFailure) {
  Walk walk(6, 100);
  walk.given_fix_sigma = 3;
  walk.build();
  CalibrationOptions options;
  double excess = 0;
  options.solve = [&](Problem& problem) {
    Summary summary = solve(problem, {});
    summary.cost += excess += 100;
    return summary;
  };
  const Calibration found = calibrate(walk.problem, {walk.fixes}, options);
  EXPECT_EQ(found.status, Status::failed);
  EXPECT_THAT(found.message, HasSubstr("no step"));
}

/// Some solves fail and change values, also of a group that the library does not name.
TEST(Calibrate, NeverChangesTheProblems) {
  using R4 = Rn<4>;
  const Vector<4> away(9, 9, 9, 9);
  enum class End { success, interruption, exception, no_solution };
  for (const End end : {End::success, End::interruption, End::exception, End::no_solution}) {
    Walk walk(6, 60);
    walk.given_fix_sigma = 3;
    walk.build();
    const auto other = walk.problem.add(R4(Vector<4>(1, 2, 3, 4)));
    walk.problem.minimize(Prior<R4>{R4(Vector<4>(0, 0, 0, 1))}, Gaussian(Vector<4>::Ones()), {other});
    const std::vector<NoiseGroup> groups{walk.steps, walk.fixes};
    const Block fix = walk.fixes.rows[0].block;
    const double start = walk.problem.value(walk.variables[7]).vector()[0];
    std::atomic<bool> stop = false;
    CalibrationOptions options;
    options.stop = Stop(&stop);
    int calls = 0;
    options.solve = [&](Problem& problem) {
      if (++calls % 4 != 2 && end != End::no_solution) return solve(problem, {});
      problem.set_value(problem.counterpart(other), R4(away));
      return Summary();
    };
    options.progress = [&](int iteration, const Eigen::VectorXd&, double) {
      if (end == End::exception && iteration == 2) throw std::runtime_error("from a callback");
      stop = end == End::interruption;
    };
    Calibration found;
    try {
      found = calibrate(walk.problem, groups, options);
      EXPECT_EQ(found.status, end == End::success ? Status::converged : Status::interrupted) << found.message;
    } catch (const std::runtime_error&) {
      EXPECT_TRUE(end == End::exception || end == End::no_solution);
    }
    EXPECT_EQ(walk.problem.value(walk.variables[7]).vector()[0], start);
    EXPECT_EQ(walk.problem.value(other).vector(), Vector<4>(1, 2, 3, 4));
    EXPECT_EQ(walk.problem.noise(fix).covariance_matrix()(0, 0), 9);
    if (end != End::success) continue;
    const Problem& solved = *found.problems.at(0);
    EXPECT_NEAR(std::sqrt(solved.noise(fix).covariance_matrix()(0, 0)), 3 * found.noise[1].factor, 1e-9);
    EXPECT_NEAR((solved.value(solved.counterpart(other)).vector() - Vector<4>(0, 0, 0, 1)).norm(), 0, 1e-9);
    apply(found, walk.problem, groups);
    EXPECT_EQ(walk.problem.noise(fix).covariance_matrix(), solved.noise(fix).covariance_matrix());
    EXPECT_EQ(walk.problem.value(walk.variables[7]).vector(),
              solved.value(solved.counterpart(walk.variables[7])).vector());
  }
}

TEST(Calibrate, APriorPullsTowardsTheGivenValue) {
  Walk walk(9, 60), pulled(9, 60);
  walk.given_fix_sigma = pulled.given_fix_sigma = 3;
  walk.build();
  pulled.build();
  pulled.fixes.prior = 0.1;
  const double free = calibrate(walk.problem, {walk.fixes}).noise[0].factor;
  const double constrained = calibrate(pulled.problem, {pulled.fixes}).noise[0].factor;
  EXPECT_LT(free, constrained);
  EXPECT_LT(constrained, 1);
}

TEST(Calibrate, RejectsInvalidGroups) {
  Walk walk(1, 5);
  walk.build();
  const auto error = [&](std::vector<NoiseGroup> groups) -> std::string {
    try {
      calibrate(walk.problem, groups);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(error({}), HasSubstr("no noise group"));
  EXPECT_THAT(error({{"empty", {}}}), HasSubstr("the noise group empty has no rows"));
  EXPECT_THAT(error({walk.steps, walk.steps}), HasSubstr("a row is in two noise groups, steps and steps"));
  EXPECT_THAT(error({{"far", {{walk.steps.rows[0].block, 1, 1}}}}),
              HasSubstr("far refers to rows that its block does not have"));
  EXPECT_THROW(calibrate(walk.problem, {{"gone", {{Block{}}}}}), StaleHandleError);
  for (const int index : {-1, 1}) {
    CalibrationOptions options;
    options.measured = {{walk.steps.rows[0].block, index}};
    EXPECT_THROW(calibrate(walk.problem, {walk.steps}, options), BadInputError) << "no problem has this index";
    Problem* const problems[] = {&walk.problem};
    EXPECT_THROW(log_constants(problems, options.measured), BadInputError);
  }
}

TEST(Calibrate, ReturnsTheBestSoFarWhenStopped) {
  Walk walk(2);
  walk.given_step_sigma = 5;
  walk.build();
  std::atomic<bool> stop = false;
  CalibrationOptions options;
  options.stop = Stop(&stop);
  options.progress = [&](int, const Eigen::VectorXd&, double) { stop = true; };
  const Calibration found = calibrate(walk.problem, {walk.steps, walk.fixes}, options);
  EXPECT_EQ(found.status, Status::interrupted);
  EXPECT_GT(found.gain, 0);
  EXPECT_NE(found.noise[0].factor, 1);
}

/// counted_rows is updated while the noise changes. The reported gain always refers to the given noise.
TEST(Calibrate, ReportsTheGainOverTheGivenNoiseAsCountedRowsChange) {
  const auto run = [](std::vector<double>& gains, int stop_after) {
    Walk walk(5, 300, 0.05);
    walk.given_fix_sigma = 5, walk.given_step_sigma = 3;
    walk.build(Cauchy(2));
    std::atomic<bool> stop = false;
    CalibrationOptions options;
    options.ranges = false;
    options.stop = Stop(&stop);
    options.progress = [&](int, const Eigen::VectorXd&, double gain) {
      gains.push_back(gain);
      stop = static_cast<int>(gains.size()) == stop_after;
    };
    return calibrate(walk.problem, {walk.steps, walk.fixes}, options);
  };
  std::vector<double> gains;
  const Calibration found = run(gains, 0);
  ASSERT_TRUE(found.converged()) << found.message;
  ASSERT_GT(found.gain, 100);
  EXPECT_NEAR(gains.back(), found.gain, 0.01 * found.gain);
  int falls = 0;
  for (std::size_t i = 1; i < gains.size(); ++i) {
    falls += gains[i] < gains[i - 1] - 1e-6;
    EXPECT_GT(gains[i], 0.8 * gains[i - 1]) << "iteration " << i << ": the gain does not restart at zero";
  }
  EXPECT_GE(falls, 1) << "the update of counted_rows, which this test is about";
  for (int n = 1; n <= static_cast<int>(gains.size()); ++n) {
    std::vector<double> some;
    EXPECT_EQ(run(some, n).gain, gains[std::size_t(n) - 1]) << "stopped after iteration " << n;
  }
}

TEST(Calibrate, KeepsTheGivenNoiseIfStoppedBeforeTheFirstSolve) {
  Walk walk(2);
  walk.build();
  const std::atomic<bool> stop = true;
  CalibrationOptions options;
  options.stop = Stop(&stop);
  const Calibration found = calibrate(walk.problem, {walk.steps, walk.fixes}, options);
  EXPECT_EQ(found.status, Status::interrupted);
  EXPECT_EQ(found.gain, 0);
  EXPECT_EQ(found.solves, 0);
  ASSERT_EQ(found.noise.size(), 2u);
  for (const CalibratedNoise& noise : found.noise) EXPECT_EQ(noise.factor, 1);
}

}  // namespace
}  // namespace tandem::testing
