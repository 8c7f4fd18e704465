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

/// A simulated run whose sensors can be given systematic errors.
struct FaultyRun {
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

/// The DVL has a forward bias of 0.1 m/s, which GPS makes observable.
TEST(EgoSystematicErrors, EstimatesObservableBias) {
  FaultyRun run;
  EgoSensor& dvl = run.sensor(EgoSensorType::dvl);
  for (EgoMeasurement& m : dvl.measurements) m.value.x() += 0.1;
  const double plain = run.turn.largest_error(run.solved());
  dvl.error = SystematicError{Vector<3>::Constant(0.3)};
  const NavigationProblem constant = run.solved();
  EXPECT_LE(run.turn.largest_error(constant), 0.02);
  EXPECT_GT(plain, 5 * run.turn.largest_error(constant));
  ASSERT_EQ(constant.constants.size(), 1u) << "one constant bias for the whole run";
  EXPECT_EQ(constant.constants[0].name, "dvl.bias");
  EXPECT_EQ(constant.constants[0].sigma, dvl.error->bias_sigma);
  EXPECT_NEAR(constant.problem.value(std::get<Variable<R3>>(constant.constants[0].state)).vector().x(), 0.1, 0.01);
  dvl.error->correlation_time = 100;
  EXPECT_TRUE(run.solved().constants.empty()) << "a bias with a finite correlation time is not a constant";
  EXPECT_LE(run.turn.largest_error(run.solved()), 0.03);
}

/// The DVL has a misalignment and a scale factor error, and GPS has an unknown delay.
TEST(EgoSystematicErrors, EstimatesScaleMisalignmentAndDelay) {
  const double scale = 0.05, delay = 0.2;
  const Vector<3> turn(0.02, -0.03, 0.06);
  FaultyRun run;
  EgoSensor &dvl = run.sensor(EgoSensorType::dvl), &gps = run.sensor(EgoSensorType::gps);
  for (EgoMeasurement& m : dvl.measurements) m.value = (1 + scale) * SO3::Exp(turn).inverse().act(m.value);
  for (EgoMeasurement& m : gps.measurements) m.value = run.turn.measure(gps, m.t - delay).value;
  gps.sigma.setConstant(0.02);
  dvl.error = SystematicError{.scale_sigma = 0.1, .misalignment_sigma = 0.1};
  gps.error = SystematicError{.delay_sigma = 0.3};
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
  EXPECT_LT(std::abs(turned.x()), 0.005)
      << "rotation about the direction of travel is not observable, so the prior mean remains";
  EXPECT_LE(run.turn.largest_error(found), 0.05);
}

TEST(EgoSystematicErrors, SharesDvlScaleWithOption) {
  FaultyRun run;
  run.turn.dvl_scale = 0.05;
  run.data = run.turn.data();
  run.sensor(EgoSensorType::dvl).error = SystematicError{Vector<3>::Constant(0.001)};
  NavigationProblem built = make_navigation_problem(run.data, run.turn.guess(), run.turn.start(), {.dvl_scale = true});
  EXPECT_TRUE(solve(built.problem, GaussNewtonOptions{}).converged());
  ASSERT_EQ(built.constants.size(), 1u);
  EXPECT_EQ(built.constants[0].name, "dvl.bias") << "the scale factor belongs to EgoOptions::dvl_scale";
  EXPECT_NEAR(built.problem.value(*built.dvl_scale).vector()[0], 0.05, 0.005);
}

/// A constant bias has one state for the whole run; a bias with a short correlation time has one per measurement.
TEST(EgoSystematicErrors, NumberOfBiasStatesDependsOnCorrelationTime) {
  FaultyRun run;
  EgoSensor& depth = run.sensor(EgoSensorType::depth);
  const auto num_states = [&] {
    const NavigationProblem problem = make_navigation_problem(run.data, run.turn.guess(), run.turn.start());
    return std::count_if(problem.measurements.begin(), problem.measurements.end(),
                         [](const PlacedEgoMeasurement& m) { return m.bias_block.has_value(); });
  };
  EXPECT_EQ(num_states(), 0);
  depth.error = SystematicError{Eigen::VectorXd::Constant(1, 0.2)};
  EXPECT_EQ(num_states(), 1);
  depth.error->correlation_time = 5;
  EXPECT_EQ(std::size_t(num_states()), depth.measurements.size());
  depth.error->correlation_time = 1e7;
  EXPECT_EQ(num_states(), 1) << "the bias hardly changes in 20 s";
}

/// Only the depth sensor measures the height, so its bias is not observable.
TEST(EgoSystematicErrors, UnobservableBiasKeepsPriorSigma) {
  FaultyRun run;
  run.data.sensors.erase(std::remove_if(run.data.sensors.begin(), run.data.sensors.end(),
                                        [](const EgoSensor& s) { return s.type == EgoSensorType::gps; }),
                         run.data.sensors.end());
  Alignment start = run.turn.start();
  start.sigmas.position.z() = 10;
  const auto sigma = [&] {
    NavigationProblem problem = make_navigation_problem(run.data, run.turn.guess(), start);
    EXPECT_TRUE(solve(problem.problem, GaussNewtonOptions{}).converged());
    Marginals marginals(problem.problem);
    return std::sqrt(marginals.covariance(problem.keyframes.back().pose)(2, 2));
  };
  EXPECT_LT(sigma(), 0.05);
  run.sensor(EgoSensorType::depth).error = SystematicError{Eigen::VectorXd::Constant(1, 0.4)};
  EXPECT_NEAR(sigma(), 0.4, 0.02);
}

TEST(EgoSystematicErrors, RejectsUnsupportedErrors) {
  FaultyRun run;
  const auto rejection = [&](const EgoOptions& options = {}) -> std::string {
    try {
      make_navigation_problem(run.data, run.turn.guess(), run.turn.start(), options);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  run.sensor(EgoSensorType::depth).error = SystematicError{Vector<3>::Constant(1)};
  EXPECT_THAT(rejection(), HasSubstr(".error: a depth needs 1 standard deviations, not 3"));
  run.sensor(EgoSensorType::depth).error.reset();
  run.sensor(EgoSensorType::dvl).error = SystematicError{Vector<3>::Constant(1)};
  EXPECT_EQ(rejection(), "");
  EXPECT_THAT(rejection({.preintegrated_dvl = true}),
              HasSubstr("preintegrated DVL velocities do not support systematic errors"));
  run.sensor(EgoSensorType::dvl).error.reset();
  run.sensor(EgoSensorType::gps).error = SystematicError{.scale_sigma = 0.1};
  EXPECT_THAT(rejection(), HasSubstr("gps.error: a gps has no scale factor"));
  run.sensor(EgoSensorType::gps).error = SystematicError{.misalignment_sigma = 0.1};
  EXPECT_THAT(rejection(), HasSubstr("does not depend on the sensor's orientation"));
  run.sensor(EgoSensorType::gps).error.reset();
  run.sensor(EgoSensorType::heading).error = SystematicError{.misalignment_sigma = 0.1};
  EXPECT_THAT(rejection(), HasSubstr("heading is its bias"));
  run.sensor(EgoSensorType::heading).error = SystematicError{.delay_sigma = 0.1};
  EXPECT_EQ(rejection(), "");
  run.sensor(EgoSensorType::heading).error = SystematicError{.delay_sigma = std::numeric_limits<double>::quiet_NaN()};
  EXPECT_THAT(rejection(), HasSubstr("the standard deviation of the delay must be zero or positive, and finite"));
  run.sensor(EgoSensorType::heading).error = SystematicError{.delay_sigma = 61};
  EXPECT_THAT(rejection(), HasSubstr("of the delay must be 60 s at most"));
  run.sensor(EgoSensorType::heading).error = SystematicError{Vector<3>(1, std::numeric_limits<double>::quiet_NaN(), 1)};
  EXPECT_THAT(rejection(), HasSubstr("heading.error: the standard deviations of the bias must be positive and finite"));
  run.sensor(EgoSensorType::heading).error = SystematicError{Vector<3>::Constant(1), -1};
  EXPECT_THAT(rejection(), HasSubstr("the correlation time must be positive"));
  run.sensor(EgoSensorType::heading).error = SystematicError{.delay_sigma = 0.1};
  run.data.imu.reset();
  EXPECT_THAT(rejection(), HasSubstr("estimating a delay needs an imu"));
}

}  // namespace
}  // namespace tandem
