#include <cmath>
#include <tuple>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/built_evidence.hpp>

#include "damped_point.hpp"

namespace tandem::testing {
namespace {

using ::testing::HasSubstr;

TEST(LongCalibrateBuilt, ReachesTheMaximumLikelihoodWithTheRightCovariance) {
  DampedPoint point(3, 800);
  point.error = 2;  // given value; the truth is half of it
  const std::vector<BuiltParameter> parameters = {{"twist_time", 20, 0}, {"error_time", 8, 0}};
  const auto found =
      calibrate_built([&](const Eigen::VectorXd& values) { return point.build(values, false); }, parameters);
  ASSERT_TRUE(found.converged()) << found.message;
  // A Newton step of the exact likelihood over all five log parameters from the estimate.
  Eigen::VectorXd at(5);
  at << found.values.array().log().matrix(), std::log(found.noise.noise[0].factor),
      std::log(found.noise.noise[1].factor), std::log(found.noise.noise[2].factor);
  const auto f = [&](const Eigen::VectorXd& x) {
    const Eigen::VectorXd e = x.array().exp();
    return point.exact(e.head(2), e.tail<3>());
  };
  const double h = 1e-2;
  Eigen::VectorXd g(5);
  Eigen::MatrixXd H(5, 5);
  for (int i = 0; i < 5; ++i) {
    const Eigen::VectorXd ei = h * Eigen::VectorXd::Unit(5, i);
    g[i] = (f(at + ei) - f(at - ei)) / (2 * h);
    for (int j = 0; j < 5; ++j) {
      const Eigen::VectorXd ej = h * Eigen::VectorXd::Unit(5, j);
      H(i, j) = (f(at + ei + ej) - f(at + ei - ej) - f(at - ei + ej) + f(at - ei - ej)) / (4 * h * h);
    }
  }
  const Eigen::MatrixXd covariance = (-H).inverse();
  EXPECT_LE(0.5 * g.dot(covariance * g), 2e-3) << "predicted gain of the Newton step";
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(found.parameters[std::size_t(i)].identifiable);
    EXPECT_NEAR(found.parameters[std::size_t(i)].log_error, std::sqrt(covariance(i, i)),
                0.1 * std::sqrt(covariance(i, i)));
  }
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(found.noise.noise[std::size_t(i)].log_error, std::sqrt(covariance(2 + i, 2 + i)),
                0.1 * std::sqrt(covariance(2 + i, 2 + i)));
  Eigen::VectorXd given(5);
  given << std::log(20), std::log(8), 0, 0, 0;
  EXPECT_NEAR(found.gain, f(at) - f(given), 1e-3);
}

TEST(CalibrateBuilt, KeepsAParameterThatIsNotIdentifiable) {
  DampedPoint point(5, 60);
  point.error = 1e-3;  // so small that its time constant has no effect
  const auto found = calibrate_built(
      [&](const Eigen::VectorXd& values) {
        BuiltProblems built = point.build(Eigen::Vector2d(10, values[0]), true);
        built.groups.clear();
        return built;
      },
      {{"error_time", 6, 1}});
  ASSERT_TRUE(found.converged());
  EXPECT_FALSE(found.parameters[0].identifiable || found.parameters[0].bounded);
  EXPECT_EQ(found.values[0], 6);
  EXPECT_LT(found.parameters[0].flat_from, 0.2);
  EXPECT_GT(found.parameters[0].flat_to, 5);
  EXPECT_TRUE(found.noise.noise.empty());
}

/// Problems built from both time constants, with the given noise.
BuiltProblems without_groups(const DampedPoint& point, const Eigen::VectorXd& values) {
  BuiltProblems built = point.build(values, true);
  built.groups.clear();
  return built;
}
BuiltProblems by_twist_time(const DampedPoint& point, double time) {
  return without_groups(point, Eigen::Vector2d(time, point.error_time));
}

TEST(CalibrateBuilt, ReportsWhereProblemsCannotBeBuilt) {
  const DampedPoint point(3, 400);  // true time constant: 10 s
  int builds = 0, solvable = 0;
  const auto found = calibrate_built(
      [&](const Eigen::VectorXd& values) {
        ++builds;
        if (values[0] < 25) throw Error("too short");
        ++solvable;
        return by_twist_time(point, values[0]);
      },
      {{"twist_time", 60, 0}});
  EXPECT_EQ(found.status, Status::failed);
  EXPECT_THAT(found.message, HasSubstr("cannot be built or solved beyond twist_time = 2"));
  EXPECT_EQ(found.builds, builds);
  EXPECT_GE(found.solves, solvable) << "each problem is solved at least once";
  EXPECT_FALSE(found.parameters[0].identifiable) << "the data do not bound it below";
  EXPECT_TRUE(found.parameters[0].bounded);
  EXPECT_NEAR(found.values[0], 25, 1);
  EXPECT_GE(found.parameters[0].flat_from * 60, 25 - 1e-9);
}

TEST(CalibrateBuilt, ARangeThatEndsWithTheProblemsIsNotBoundedByTheData) {
  const DampedPoint point(3, 400);
  double least = 1;
  const auto find = [&] {
    return calibrate_built(
        [&](const Eigen::VectorXd& values) {
          if (values[0] < least) throw Error("too short");
          return by_twist_time(point, values[0]);
        },
        {{"twist_time", 20, 0}});
  };
  const auto free = find();
  ASSERT_TRUE(free.converged()) << free.message;
  ASSERT_TRUE(free.parameters[0].identifiable);
  least = 0.5 * (free.values[0] + 20 * free.parameters[0].flat_from);
  const auto cut = find();
  EXPECT_TRUE(cut.converged()) << cut.message;
  EXPECT_FALSE(cut.parameters[0].identifiable);
}

TEST(CalibrateBuilt, KeepsTheStatusOfAnUnfinishedSearch) {
  DampedPoint point(3, 200);
  point.error = 1e-3;  // its time constant is not identifiable
  CalibrationOptions options;
  options.max_iterations = 1;
  const auto found = calibrate_built([&](const Eigen::VectorXd& values) { return without_groups(point, values); },
                                     {{"twist_time", 200, 0}, {"error_time", 6, 1}}, options);
  EXPECT_FALSE(found.parameters[1].identifiable || found.parameters[1].bounded);
  EXPECT_EQ(found.status, Status::max_iterations) << found.message;
}

TEST(CalibrateBuilt, StaysWithinTheBounds) {
  const DampedPoint point(3, 200);
  for (const auto& [given, least, most] : {std::tuple(10.0, 9.8, 10.2), {60.0, 25.0, 61.0}, {7.0, 7.0, 7.3}}) {
    double lowest = HUGE_VAL, highest = 0;
    CalibrationOptions options;
    options.profile_points = 5;
    const auto found = calibrate_built(
        [&](const Eigen::VectorXd& values) {
          lowest = std::min(lowest, values[0]);
          highest = std::max(highest, values[0]);
          return by_twist_time(point, values[0]);
        },
        {{"twist_time", given, 0, least, most}}, options);
    EXPECT_TRUE(found.converged()) << found.message;
    EXPECT_GE(lowest, least);
    EXPECT_LE(highest, most);
    EXPECT_GT(highest, lowest);
  }
}

TEST(CalibrateBuilt, OneSidedDerivativesAtABoundAgreeWithCentralOnes) {
  const DampedPoint point(3, 200);
  const BuildProblems build = [&](const Eigen::VectorXd& values) { return by_twist_time(point, values[0]); };
  const CalibrationOptions options;
  const auto slopes = [&](double least, double given, double most) {
    const std::vector<BuiltParameter> parameters = {{"twist_time", given, 0, least, most}};
    detail::BuiltEvidence evidence(build, parameters, options);
    Calibration noise;
    double as_given;
    const auto here = evidence.first(noise, as_given);
    return evidence.derivatives(Eigen::VectorXd::Zero(1), here, 0);
  };
  const double h = 0.05, up = 20 * std::exp(h), down = 20 * std::exp(-h);  // the step of the differences
  const double first = slopes(0, 20, HUGE_VAL).first;
  ASSERT_GT(std::abs(first), 1);
  EXPECT_NEAR(slopes(20, 20, HUGE_VAL).first, first, 0.01 * std::abs(first));
  EXPECT_NEAR(slopes(0, 20, 20).first, first, 0.01 * std::abs(first));
  EXPECT_NEAR(slopes(19.9, 20, 21).first, first, 0.01 * std::abs(first));
  EXPECT_EQ(slopes(20, 20, 20).first, 0);
  EXPECT_NEAR(slopes(20, 20, HUGE_VAL).second, slopes(0, up, HUGE_VAL).second, 1e-3) << "from the same three points";
  EXPECT_NEAR(slopes(0, 20, 20).second, slopes(0, down, HUGE_VAL).second, 1e-3);
}

/// Problems that cannot be built if only one parameter has its given value and the other one is far from it.
BuildProblems only_both_given(const DampedPoint& point, const Eigen::Vector2d& given, double reach = 0.2) {
  return [&point, given, reach](const Eigen::VectorXd& values) {
    const Eigen::Vector2d off = (values.array() / given.array()).log().abs();
    if (off.minCoeff() < 0.01 && off.maxCoeff() > reach) throw Error("no such problem");
    return without_groups(point, values);
  };
}

TEST(CalibrateBuilt, ResetsAnUnidentifiableParameterAlthoughTheOthersMustMove) {
  DampedPoint point(5, 200);
  point.error = 0.05;
  const auto found =
      calibrate_built(only_both_given(point, {60, 12}, 0.8), {{"twist_time", 60, 0}, {"error_time", 12, 0}});
  ASSERT_FALSE(found.parameters[0].identifiable || found.parameters[0].bounded);
  EXPECT_EQ(found.values[0], 60);
  EXPECT_EQ(found.parameters[0].factor, 1);
  EXPECT_TRUE(found.parameters[1].bounded);
  EXPECT_LT(found.values[1], 12);
  EXPECT_GE(found.values[1], 12 * std::exp(-0.8) - 1e-9) << "problems exist with the other parameter reset";
  EXPECT_THAT(found.message, HasSubstr("beyond error_time = 5.4"));
}

TEST(CalibrateBuilt, ReportsNoGainIfTheGivenValueCannotBeBuilt) {
  const DampedPoint point(3, 400);
  CalibrationOptions options;
  options.profile_points = 21;
  const auto found =
      calibrate_built(only_both_given(point, {30, 9}), {{"twist_time", 30, 0}, {"error_time", 9, 0}}, options);
  for (const CalibratedNoise& p : found.parameters) {
    EXPECT_NE(p.factor, 1);
    EXPECT_EQ(p.gain, 0);
    EXPECT_FALSE(p.profile.empty());
    for (const auto& [factor, fall] : p.profile) EXPECT_TRUE(std::isfinite(fall)) << factor;
  }
}

TEST(CalibrateBuilt, ReturnsTheBestSoFarWhenStopped) {
  const DampedPoint point(3, 200);
  std::atomic<bool> stop = false;
  CalibrationOptions options;
  options.stop = Stop(&stop);
  options.progress = [&](int, const Eigen::VectorXd& factors, double) { stop = factors.size() == 4; };
  const auto found =
      calibrate_built([&](const Eigen::VectorXd& values) { return point.build(Eigen::Vector2d(values[0], 3), true); },
                      {{"twist_time", 60, 0}}, options);
  EXPECT_EQ(found.status, Status::interrupted);
  EXPECT_GT(found.gain, 0);
  EXPECT_LT(found.values[0], 60);
  ASSERT_EQ(found.noise.noise.size(), 3u);
  EXPECT_NE(found.noise.noise[0].factor, 1);
}

TEST(CalibrateBuilt, RejectsInvalidParameters) {
  const DampedPoint point(3, 20);
  const auto build = [&](const Eigen::VectorXd& values) { return point.build(Eigen::Vector2d(values[0], 3), false); };
  const auto error = [&](const std::vector<BuiltParameter>& parameters) -> std::string {
    try {
      calibrate_built(build, parameters);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(error({}), HasSubstr("no parameter"));
  EXPECT_THAT(error({{"time", 0.0}}), HasSubstr("parameter time needs a positive"));
  EXPECT_THAT(error({{"time", 6, 1, 10, 20}}), HasSubstr("within its bounds"));
}

}  // namespace
}  // namespace tandem::testing
