#include <cmath>
#include <random>

#include <Eigen/Cholesky>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/residuals/bounds.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/calibration/calibrate.hpp>
#include <tandem/solvers/calibration/cross_validation.hpp>
#include <tandem/solvers/calibration/evidence.hpp>
#include <tandem/solvers/gauss_newton.hpp>

/// Against the exact evidence of linear Gaussian problems, by dense matrices.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using Number = Rn<1>;
using R2 = Rn<2>;

/// A random walk of n steps of sigma `walk`, seen with sigma `seen`; begun near 0.
struct Walk {
  int n = 300;
  double walk = 0.5, seen = 1.0, begun = 10.0;
  std::vector<double> z;
  double given_walk = 1.0, given_seen = 1.0;
  Problem problem;
  std::vector<Variable<Number>> variables;
  NoiseGroup steps{"steps", {}, 0}, fixes{"fixes", {}, 0};

  explicit Walk(unsigned seed, int length = 300, double outliers = 0) : n(length) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    double x = 0;
    for (int i = 0; i < n; ++i, x += walk * normal(random)) {
      z.push_back(x + seen * normal(random));
      if (uniform(random) < outliers) z.back() += 100;
    }
  }
  void build(const Loss& loss = {}) {
    auto& x = variables;
    for (int i = 0; i < n; ++i) {
      x.push_back(problem.add(Number(Vector<1>(z[std::size_t(i)]))));
      if (i == 0) {
        problem.minimize(Prior<Number>{Number()}, {begun}, {x[0]});
      } else {
        steps.rows.push_back({problem.minimize(RelativePose<Number>{Number()}, {given_walk},
                                               {x[std::size_t(i) - 1], x[std::size_t(i)]})});
      }
      fixes.rows.push_back({problem.minimize(Prior<Number>{Number(Vector<1>(z[std::size_t(i)]))}, {given_seen},
                                             {x[std::size_t(i)]}, loss)});
    }
  }
  /// Log density of z for factors on what is given, but for a constant.
  double exact(double log_steps, double log_fixes) const {
    const double q = std::pow(given_walk * std::exp(log_steps), 2), r = std::pow(given_seen * std::exp(log_fixes), 2);
    Eigen::MatrixXd S(n, n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) S(i, j) = begun * begun + q * std::min(i, j) + (i == j ? r : 0.0);
    const Eigen::LLT<Eigen::MatrixXd> llt(S);
    const Eigen::Map<const Eigen::VectorXd> d(z.data(), n);
    return -0.5 * d.dot(llt.solve(d)) - llt.matrixLLT().diagonal().array().log().sum();
  }
};

TEST(Evidence, IsExactWhereTheProblemIsLinear) {
  Walk walk(1, 60);
  walk.build();
  Problem* const one[] = {&walk.problem};
  const std::vector<NoiseGroup> groups = {walk.steps, walk.fixes};
  const CalibrationOptions options;
  detail::Evidence evidence(one, groups, options);
  const double constant = evidence.at(Eigen::Vector2d::Zero()).log_evidence - walk.exact(0, 0);
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(0.5, -0.3), Eigen::Vector2d(-1, 0.2), Eigen::Vector2d(2, 1)}) {
    const auto value = evidence.at(at);
    ASSERT_TRUE(value.usable) << value.why;
    EXPECT_NEAR(value.log_evidence - constant, walk.exact(at[0], at[1]), 1e-8 * std::abs(value.log_evidence));
    const double h = 1e-4;
    EXPECT_NEAR(value.gradient[0], (walk.exact(at[0] + h, at[1]) - walk.exact(at[0] - h, at[1])) / (2 * h), 1e-4);
    EXPECT_NEAR(value.gradient[1], (walk.exact(at[0], at[1] + h) - walk.exact(at[0], at[1] - h)) / (2 * h), 1e-4);
  }
}

TEST(Evidence, BeliefsThatOverlapAreDividedByTheirIntegral) {
  // A walk that also keeps near 0: the two together are one density, of which neither sigma has so many rows.
  Walk walk(4, 60);
  walk.build();
  NoiseGroup level{"level", {}, 0};
  CalibrationOptions options;
  for (const NoiseRows& fix : walk.fixes.rows) {
    options.measured.push_back({fix.block});
    const int x = walk.problem.linearization(fix.block).variable_ids[0];
    level.rows.push_back({walk.problem.minimize(Prior<Number>{Number()}, {2.0}, {walk.variables[std::size_t(x)]})});
  }
  const auto exact = [&](double log_steps, double log_level) {
    const double q = std::exp(2 * log_steps), l = 4 * std::exp(2 * log_level);
    Eigen::MatrixXd information = Eigen::MatrixXd::Identity(walk.n, walk.n) / l;
    information(0, 0) += 1 / (walk.begun * walk.begun);
    for (int i = 1; i < walk.n; ++i) {
      information(i, i) += 1 / q;
      information(i - 1, i - 1) += 1 / q;
      information(i, i - 1) -= 1 / q;
      information(i - 1, i) -= 1 / q;
    }
    const Eigen::MatrixXd S = information.inverse() + Eigen::MatrixXd::Identity(walk.n, walk.n);
    const Eigen::LLT<Eigen::MatrixXd> llt(S);
    const Eigen::Map<const Eigen::VectorXd> d(walk.z.data(), walk.n);
    return -0.5 * d.dot(llt.solve(d)) - llt.matrixLLT().diagonal().array().log().sum();
  };
  Problem* const one[] = {&walk.problem};
  const std::vector<NoiseGroup> groups = {walk.steps, level};
  detail::Evidence evidence(one, groups, options);
  const double constant = evidence.at(Eigen::Vector2d::Zero()).log_evidence - exact(0, 0);
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(-0.7, 0.4), Eigen::Vector2d(0.5, -1), Eigen::Vector2d(-3, 1)}) {
    const auto value = evidence.at(at);
    ASSERT_TRUE(value.usable) << value.why;
    EXPECT_NEAR(value.log_evidence - constant, exact(at[0], at[1]), 0.02);
    const double h = 1e-5;
    EXPECT_NEAR(value.gradient[0], (exact(at[0] + h, at[1]) - exact(at[0] - h, at[1])) / (2 * h), 0.02);
    EXPECT_NEAR(value.gradient[1], (exact(at[0], at[1] + h) - exact(at[0], at[1] - h)) / (2 * h), 0.02);
  }
}

TEST(Evidence, ItsInformationIsTheAverageOfObservedAndExpected) {
  for (const bool beliefs : {false, true}) {
    Walk walk(5, 40);
    walk.build();
    CalibrationOptions options;
    if (beliefs)
      for (const NoiseRows& fix : walk.fixes.rows) options.measured.push_back({fix.block});
    Problem* const one[] = {&walk.problem};
    const std::vector<NoiseGroup> groups = {walk.steps, walk.fixes};
    detail::Evidence evidence(one, groups, options);
    const Eigen::Vector2d at(-0.4, 0.3);
    ASSERT_TRUE(evidence.at(at).usable);
    const auto information = evidence.information();
    ASSERT_TRUE(information);

    // ½ (P z)ᵀ V_g P V_h P z, P = V⁻¹, by the covariance of z and its derivatives.
    const double q = std::exp(2 * at[0]), r = std::exp(2 * at[1]);
    Eigen::MatrixXd of_steps(walk.n, walk.n);
    for (int i = 0; i < walk.n; ++i)
      for (int j = 0; j < walk.n; ++j) of_steps(i, j) = q * std::min(i, j);
    const Eigen::MatrixXd of_fixes = r * Eigen::MatrixXd::Identity(walk.n, walk.n);
    const Eigen::MatrixXd begun = Eigen::MatrixXd::Constant(walk.n, walk.n, walk.begun * walk.begun);
    const Eigen::LLT<Eigen::MatrixXd> V(begun + of_steps + of_fixes);
    const Eigen::VectorXd Pz = V.solve(Eigen::Map<const Eigen::VectorXd>(walk.z.data(), walk.n));
    Eigen::MatrixXd pulled(walk.n, 2);
    pulled << 2 * of_steps * Pz, 2 * of_fixes * Pz;
    const Eigen::Matrix2d expected = 0.5 * pulled.transpose() * V.solve(pulled);
    EXPECT_LE((*information - expected).cwiseAbs().maxCoeff(), (beliefs ? 1e-3 : 1e-7) * expected.maxCoeff())
        << *information << "\n\n"
        << expected;
  }
}

TEST(Calibrate, FindsTheMaximumOfTheEvidence) {
  Walk walk(2);
  walk.given_walk = 5, walk.given_seen = 0.1;
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
  EXPECT_LE(off.cwiseAbs().maxCoeff(), 2e-3) << "a Newton step of the exact evidence";
  EXPECT_LE((found.log_covariance - covariance).cwiseAbs().maxCoeff(), 0.02 * covariance.cwiseAbs().maxCoeff());
  EXPECT_NEAR(5 * found.noise[0].factor, walk.walk, 0.15 * walk.walk);
  EXPECT_NEAR(0.1 * found.noise[1].factor, walk.seen, 0.15 * walk.seen);
  EXPECT_NEAR(found.gain, walk.exact(a, b) - walk.exact(0, 0), 1e-6 * std::abs(found.gain));
  EXPECT_TRUE(found.noise[0].determined && found.noise[1].determined);
  EXPECT_LE(found.iterations, 20);
  EXPECT_EQ(found.noise[1].rows, 300);
}

TEST(Calibrate, TrueValuesAreWithinTwoStandardErrorsAsOftenAsTheyShould) {
  int within = 0, of = 0;
  double sum = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    Walk walk(100 + seed, 150);
    walk.build();
    const Calibration found = calibrate(walk.problem, {walk.steps, walk.fixes});
    ASSERT_TRUE(found.converged());
    const double truth[] = {walk.walk, walk.seen};
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

TEST(Calibrate, SeveralProblemsShareAFactor) {
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

/// Rows of a full covariance in different groups, under a hard equality: against differences of the evidence, which is
/// exact for a problem that is linear.
TEST(Evidence, ItsGradientIsRightForFullNoiseAndUnderEqualities) {
  Problem problem;
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  Eigen::Matrix2d S;
  S << 2, 0.8, 0.8, 1;
  NoiseGroup first{"first", {}, 0.7}, second{"second", {}, 0}, steps{"steps", {}, 0};
  std::vector<Variable<R2>> x;
  for (int i = 0; i < 12; ++i) {
    x.push_back(problem.add(R2(Vector<2>(0, 0))));
    const Block fix = problem.minimize(Prior<R2>{R2(Vector<2>(2 * normal(random), normal(random)))},
                                       Gaussian::covariance(S), {x.back()});
    first.rows.push_back({fix, 0, 1});
    second.rows.push_back({fix, 1, 1});
    if (i > 0)
      steps.rows.push_back({problem.minimize(RelativePose<R2>{R2()}, {0.7, 0.4}, {x[std::size_t(i) - 1], x.back()})});
  }
  problem.subject_to(RelativePose<R2>{R2(Vector<2>(0.3, 0.1))}, equal_to(0), {x[2], x[9]});
  Problem* const one[] = {&problem};
  const std::vector<NoiseGroup> groups = {first, second, steps};
  const CalibrationOptions options;
  detail::Evidence evidence(one, groups, options);
  const Eigen::Vector3d at(0.3, -0.2, 0.4);
  const Eigen::VectorXd gradient = evidence.at(at).gradient;
  for (int g = 0; g < 3; ++g) {
    const double h = 1e-4;
    const Eigen::Vector3d up = at + h * Eigen::Vector3d::Unit(g), down = at - h * Eigen::Vector3d::Unit(g);
    const double by = (evidence.at(up).log_evidence - evidence.at(down).log_evidence) / (2 * h);
    EXPECT_NEAR(gradient[g], by, 1e-5 * (1 + std::abs(by))) << groups[std::size_t(g)].name;
  }
}

TEST(Calibrate, OutliersCountForWhatTheLossLeavesOfThem) {
  Walk plain(5, 300, 0.05), bounded(5, 300, 0.05), rejecting(5, 300, 0.05);
  plain.build();
  bounded.build(Cauchy(2));
  rejecting.build(Tukey(4));
  EXPECT_GE(calibrate(plain.problem, {plain.fixes}).noise[0].factor, 10);
  EXPECT_LE(calibrate(bounded.problem, {bounded.fixes}).noise[0].factor, 1.5) << "each counts for 4 of 0.66 at most";
  EXPECT_NEAR(calibrate(rejecting.problem, {rejecting.fixes}).noise[0].factor, 1, 0.25);
}

TEST(StatisticalCalibrate, ALossDoesNotChangeWhatIsFoundOfNormalNoise) {
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

TEST(Calibrate, WhatTheDataDoNotTellKeepsWhatWasGiven) {
  Walk walk(6, 100);
  walk.build();
  // One row that a state of its own takes: any sigma explains it as well.
  const auto bias = walk.problem.add(Number());
  NoiseGroup alone{"alone", {{walk.problem.minimize(Prior<Number>{Number()}, {0.3}, {bias})}}, 1.0};
  const Calibration found = calibrate(walk.problem, {walk.steps, alone, walk.fixes});
  ASSERT_TRUE(found.converged());
  EXPECT_FALSE(found.noise[1].determined);
  EXPECT_EQ(found.noise[1].factor, 1);
  EXPECT_NEAR(found.noise[1].flat_from, 0.1, 1e-3);
  EXPECT_NEAR(found.noise[1].flat_to, 10, 0.1);
  EXPECT_TRUE(found.noise[0].determined && found.noise[2].determined);
  EXPECT_LT(found.noise[2].flat_from, found.noise[2].factor);
  EXPECT_GT(found.noise[2].flat_to, found.noise[2].factor);
}

TEST(Calibrate, AWeakPriorPullsWhereTheDataAreFew) {
  Walk walk(9, 60), pulled(9, 60);
  walk.given_seen = pulled.given_seen = 3;
  walk.build();
  pulled.build();
  pulled.fixes.prior = 0.1;
  const double free = calibrate(walk.problem, {walk.fixes}).noise[0].factor;
  const double held = calibrate(pulled.problem, {pulled.fixes}).noise[0].factor;
  EXPECT_LT(free, held);
  EXPECT_LT(held, 1);
}

/// A walk whose fixes are better than was given: left-out fixes are predicted better by what is found, by as much as the
/// exact predictive densities say.
TEST(CrossValidate, FindsThatTheRightNoisePredictsBetter) {
  Walk walk(11, 200);
  walk.given_walk = 3, walk.given_seen = 0.3;
  walk.build();
  std::vector<std::vector<LeftOut>> folds(4);
  for (std::size_t i = 0; i < walk.fixes.rows.size(); ++i) folds[i % 4].push_back({walk.fixes.rows[i].block});
  Problem* const one[] = {&walk.problem};
  const double before = solve(walk.problem, GaussNewtonOptions{}).cost;
  const CrossValidation found = cross_validate(one, {walk.steps, walk.fixes}, folds);
  ASSERT_TRUE(found.complete) << found.why;
  EXPECT_EQ(found.given.size(), 200u);
  EXPECT_GT(found.gain, 3 * found.gain_error);
  int inside = 0;
  for (const auto& p : found.found) inside += p.squared_distance() <= 3.84;
  EXPECT_NEAR(inside / 200.0, 0.95, 0.05);
  EXPECT_NEAR(solve(walk.problem, GaussNewtonOptions{}).cost, before, 1e-9 * before) << "the noise is as it was given";
}

TEST(CrossValidate, APredictionIsThatOfTheOthersAlone) {
  Walk walk(12, 5);
  walk.build();
  Problem* const one[] = {&walk.problem};
  const CrossValidation found =
      cross_validate(one, {walk.steps}, {{{walk.fixes.rows[2].block}}, {{walk.fixes.rows[4].block}}});
  ASSERT_TRUE(found.complete) << found.why;
  // By the exact density of all five: of number 2 given the others.
  Eigen::MatrixXd S(5, 5);
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j) S(i, j) = 100 + std::min(i, j) + (i == j ? 1.0 : 0.0);
  const Eigen::MatrixXd information = S.inverse();
  const Eigen::Map<const Eigen::VectorXd> z(walk.z.data(), 5);
  EXPECT_NEAR(found.given[0].covariance(0, 0), 1 / information(2, 2), 1e-6);
  EXPECT_NEAR(std::abs(found.given[0].residual[0]), std::abs((information * z)[2] / information(2, 2)), 1e-6);
}

TEST(Calibrate, SaysWhatIsWrongWithGroups) {
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
  EXPECT_THAT(error({}), HasSubstr("there is no noise group"));
  EXPECT_THAT(error({{"empty", {}}}), HasSubstr("the noise group empty has no rows"));
  EXPECT_THAT(error({walk.steps, walk.steps}), HasSubstr("a row is in two noise groups, steps and steps"));
  EXPECT_THAT(error({{"far", {{walk.steps.rows[0].block, 1, 1}}}}), HasSubstr("far has rows that its block has not"));
  EXPECT_THAT(error({{"gone", {{Block{}}}}}), HasSubstr("no such block"));
}

TEST(Calibrate, StopsWithTheBestSoFar) {
  Walk walk(2);
  walk.given_walk = 5;
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

/// Rows count anew under a loss as the noise changes; what is told all along is the gain over what was given.
TEST(Calibrate, GainsAreToldAgainstWhatWasGivenAlsoAsRowsCountAnew) {
  const auto run = [](std::vector<double>& told, int stop_after) {
    Walk walk(5, 300, 0.05);
    walk.given_seen = 5, walk.given_walk = 3;
    walk.build(Cauchy(2));
    std::atomic<bool> stop = false;
    CalibrationOptions options;
    options.ranges = false;
    options.stop = Stop(&stop);
    options.progress = [&](int, const Eigen::VectorXd&, double gain) {
      told.push_back(gain);
      stop = static_cast<int>(told.size()) == stop_after;
    };
    return calibrate(walk.problem, {walk.steps, walk.fixes}, options);
  };
  std::vector<double> told;
  const Calibration found = run(told, 0);
  ASSERT_TRUE(found.converged()) << found.message;
  ASSERT_GT(found.gain, 100);
  EXPECT_NEAR(told.back(), found.gain, 0.01 * found.gain);
  int falls = 0;
  for (std::size_t i = 1; i < told.size(); ++i) {
    falls += told[i] < told[i - 1] - 1e-6;
    EXPECT_GT(told[i], 0.8 * told[i - 1]) << "iteration " << i << ": it does not begin again";
  }
  EXPECT_GE(falls, 1) << "as rows count anew, which is what is to be seen here";
  for (int n = 1; n <= static_cast<int>(told.size()); ++n) {
    std::vector<double> some;
    EXPECT_EQ(run(some, n).gain, told[std::size_t(n) - 1]) << "stopped after iteration " << n;
  }
}

TEST(Calibrate, StoppedBeforeItBeganIsAsGiven) {
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
