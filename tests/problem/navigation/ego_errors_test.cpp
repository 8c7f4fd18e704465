#include <algorithm>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>

#include "problem/tracking/level_turn.hpp"

namespace tandem {
namespace {

using ::testing::HasSubstr;
using testing::LevelTurn;

/// A run with this offset on all that one of its sensors reads.
struct Offset {
  LevelTurn turn;
  NavigationData data = turn.data();

  EgoSensor& sensor(EgoSensorType type) {
    return *std::find_if(data.sensors.begin(), data.sensors.end(), [&](const EgoSensor& s) { return s.type == type; });
  }
  NavigationProblem solved() const {
    NavigationProblem problem = make_navigation_problem(data, turn.guess(), turn.start());
    const Summary summary = solve(problem.problem, GaussNewtonOptions{});
    EXPECT_TRUE(summary.converged()) << summary.message;
    return problem;
  }
};

/// A Doppler log that reads 0.1 m/s too much ahead, which GPS contradicts.
TEST(EgoErrors, AnOffsetIsFoundWhereOthersTellIt) {
  Offset run;
  EgoSensor& dvl = run.sensor(EgoSensorType::dvl);
  for (EgoMeasurement& m : dvl.measurements) m.value.x() += 0.1;
  const double plain = run.turn.largest_error(run.solved());
  dvl.error = StayingError{Vector<3>::Constant(0.3)};
  const NavigationProblem constant = run.solved();
  EXPECT_LE(run.turn.largest_error(constant), 0.02);
  EXPECT_GT(plain, 5 * run.turn.largest_error(constant));
  ASSERT_EQ(constant.constants.size(), 1u) << "one for the whole run";
  EXPECT_EQ(constant.constants[0].name, "dvl.bias");
  EXPECT_EQ(constant.constants[0].sigma, dvl.error->sigma);
  EXPECT_NEAR(constant.problem.value(std::get<Variable<R3>>(constant.constants[0].state)).vector().x(), 0.1, 0.01);
  dvl.error->time = 100;
  EXPECT_TRUE(run.solved().constants.empty()) << "a bias that is forgotten is no constant";
  EXPECT_LE(run.turn.largest_error(run.solved()), 0.03);
}

/// A Doppler log that is turned and reads too much, beside a GPS that is late.
TEST(EgoErrors, ScaleMisalignmentAndDelayAreFound) {
  const double scale = 0.05, delay = 0.2;
  const Vector<3> turn(0.02, -0.03, 0.06);
  Offset run;
  EgoSensor &dvl = run.sensor(EgoSensorType::dvl), &gps = run.sensor(EgoSensorType::gps);
  for (EgoMeasurement& m : dvl.measurements) m.value = (1 + scale) * SO3::Exp(turn).inverse().act(m.value);
  for (EgoMeasurement& m : gps.measurements) m.value = run.turn.measure(gps, m.t - delay).value;
  gps.sigma.setConstant(0.02);
  dvl.error = StayingError{.scale = 0.1, .misalignment = 0.1};
  gps.error = StayingError{.delay = 0.3};
  const NavigationProblem found = run.solved();
  const auto value = [&]<class X>(const std::string& name, const X&) {
    const auto at = std::find_if(found.constants.begin(), found.constants.end(),
                                 [&](const SensorConstant& c) { return c.name == name; });
    return found.problem.value(std::get<Variable<X>>(at->state)).Log();
  };
  ASSERT_EQ(found.constants.size(), 3u);
  EXPECT_NEAR(value("dvl.scale", Rn<1>())[0], scale, 0.003);
  EXPECT_NEAR(value("gps.delay", Rn<1>())[0], delay, 0.01);
  const Vector<3> turned = value("dvl.misalignment", SO3());
  EXPECT_NEAR(turned.y(), turn.y(), 0.005);
  EXPECT_NEAR(turned.z(), turn.z(), 0.005);
  EXPECT_LT(std::abs(turned.x()), 0.005) << "about the way, which nothing tells: as given";
  EXPECT_LE(run.turn.largest_error(found), 0.05);
}

TEST(EgoErrors, TheDvlsScaleIsOneNumber) {
  Offset run;
  run.turn.dvl_scale = 0.05;
  run.data = run.turn.data();
  run.sensor(EgoSensorType::dvl).error = StayingError{Vector<3>::Constant(0.001)};
  NavigationProblem built = make_navigation_problem(run.data, run.turn.guess(), run.turn.start(), {.dvl_scale = true});
  EXPECT_TRUE(solve(built.problem, GaussNewtonOptions{}).converged());
  ASSERT_EQ(built.constants.size(), 1u);
  EXPECT_EQ(built.constants[0].name, "dvl.bias") << "the scale is --dvl-scale's";
  EXPECT_NEAR(built.problem.value(*built.dvl_scale).vector()[0], 0.05, 0.005);
}

/// One state for the whole run, one a measurement, and as many rows as the sensor has.
TEST(EgoErrors, ItsStatesAreTied) {
  Offset run;
  EgoSensor& depth = run.sensor(EgoSensorType::depth);
  const auto ties = [&] {
    const NavigationProblem problem = make_navigation_problem(run.data, run.turn.guess(), run.turn.start());
    return std::count_if(problem.measurements.begin(), problem.measurements.end(),
                         [](const PlacedEgoMeasurement& m) { return m.error.has_value(); });
  };
  EXPECT_EQ(ties(), 0);
  depth.error = StayingError{Eigen::VectorXd::Constant(1, 0.2)};
  EXPECT_EQ(ties(), 1);
  depth.error->time = 5;
  EXPECT_EQ(std::size_t(ties()), depth.measurements.size());
  depth.error->time = 1e7;
  EXPECT_EQ(ties(), 1) << "in 20 s it is the same";
}

/// What nothing else tells stays as wide as it was said to be: depth alone knows of the height.
TEST(EgoErrors, WhatNothingTellsKeepsItsSpread) {
  Offset run;
  run.data.sensors.erase(std::remove_if(run.data.sensors.begin(), run.data.sensors.end(),
                                        [](const EgoSensor& s) { return s.type == EgoSensorType::gps; }),
                         run.data.sensors.end());
  Alignment start = run.turn.start();
  start.spread.position.z() = 10;
  const auto sigma = [&] {
    NavigationProblem problem = make_navigation_problem(run.data, run.turn.guess(), start);
    EXPECT_TRUE(solve(problem.problem, GaussNewtonOptions{}).converged());
    Marginals marginals(problem.problem);
    return std::sqrt(marginals.covariance(problem.keyframes.back().pose)(2, 2));
  };
  EXPECT_LT(sigma(), 0.05);
  run.sensor(EgoSensorType::depth).error = StayingError{Eigen::VectorXd::Constant(1, 0.4)};
  EXPECT_NEAR(sigma(), 0.4, 0.02);
}

TEST(EgoErrors, WhatCannotWorkIsRefused) {
  Offset run;
  const auto refusal = [&](const EgoOptions& options = {}) -> std::string {
    try {
      make_navigation_problem(run.data, run.turn.guess(), run.turn.start(), options);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  run.sensor(EgoSensorType::depth).error = StayingError{Vector<3>::Constant(1)};
  EXPECT_THAT(refusal(), HasSubstr(".error: a depth needs 1 standard deviations, not 3"));
  run.sensor(EgoSensorType::depth).error.reset();
  run.sensor(EgoSensorType::dvl).error = StayingError{Vector<3>::Constant(1)};
  EXPECT_EQ(refusal(), "");
  EXPECT_THAT(refusal({.preintegrated_dvl = true}), HasSubstr("have no error that stays"));
  run.sensor(EgoSensorType::dvl).error.reset();
  run.sensor(EgoSensorType::gps).error = StayingError{.scale = 0.1};
  EXPECT_THAT(refusal(), HasSubstr("gps.error: a gps has no scale"));
  run.sensor(EgoSensorType::gps).error = StayingError{.misalignment = 0.1};
  EXPECT_THAT(refusal(), HasSubstr("does not tell how it is turned"));
  run.sensor(EgoSensorType::gps).error.reset();
  run.sensor(EgoSensorType::heading).error = StayingError{.misalignment = 0.1};
  EXPECT_THAT(refusal(), HasSubstr("is its bias"));
  run.sensor(EgoSensorType::heading).error = StayingError{.delay = 0.1};
  EXPECT_EQ(refusal(), "");
  run.sensor(EgoSensorType::heading).error = StayingError{.delay = std::numeric_limits<double>::quiet_NaN()};
  EXPECT_THAT(refusal(), HasSubstr("of its delay must be finite"));
  run.sensor(EgoSensorType::heading).error = StayingError{.delay = 61};
  EXPECT_THAT(refusal(), HasSubstr("of its delay must be 60 s at most"));
  run.sensor(EgoSensorType::heading).error = StayingError{Vector<3>(1, std::numeric_limits<double>::quiet_NaN(), 1)};
  EXPECT_THAT(refusal(), HasSubstr("heading.error: standard deviations must be finite and above zero"));
  run.sensor(EgoSensorType::heading).error = StayingError{Vector<3>::Constant(1), -1};
  EXPECT_THAT(refusal(), HasSubstr("its time must be above zero"));
  run.sensor(EgoSensorType::heading).error = StayingError{.delay = 0.1};
  run.data.imu.reset();
  EXPECT_THAT(refusal(), HasSubstr("beside an imu alone"));
}

}  // namespace
}  // namespace tandem
