#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/tracking/ego_track.hpp>
#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/navigation/navigated.hpp>
#include <tandem/studies/simulation/simulate_dive.hpp>

#include "studies/simulation/target_of_dive.hpp"

/// Chaser and target estimated together out of raw sensor data, on a simulated dive with a made-up target.
namespace tandem {
namespace {

using testing::HasSubstr;

double mean_position_error(const Estimate& estimate) { return summarise(estimate.errors).position.value().mean; }

/// Mean distance [m] of estimated target positions from the true ones, in the world.
double mean_target_error(const Estimate& estimate, const Scenario& scenario) {
  double sum = 0;
  for (std::size_t k = 0; k < estimate.keyframes.size(); ++k) {
    const auto truth = pose_at(scenario.truth_target, estimate.keyframes[k].t);
    sum += (estimate.target[k].position - truth->translation()).norm() / double(estimate.keyframes.size());
  }
  return sum;
}

TEST(JointEstimate, WithoutNoiseItIsTheTruth) {
  DiveOptions options{.grade = Grade::tactical, .minutes = 1};
  options.noise = false;
  const Scenario scenario = dive_with_target(options, 0.0);
  const Estimate joint = estimate(scenario, {}, GaussNewtonOptions{});
  ASSERT_TRUE(joint.summary.converged()) << joint.summary.message;
  // What the trapezoidal rule leaves of the waves at the surface, and constant twist of the target's curve.
  EXPECT_LE(mean_position_error(joint), 0.02);
  EXPECT_LE(mean_target_error(joint, scenario), 0.03);
  ASSERT_EQ(joint.ego_sensors.size(), 4u);
  for (const EgoSensorUse& sensor : joint.ego_sensors) {
    EXPECT_GT(sensor.used, 10u) << sensor.name;
    EXPECT_EQ(sensor.left_out, 0u) << sensor.name;
  }
  EXPECT_TRUE(joint.splits.empty());
  EXPECT_EQ(joint.uncertainty.size(), joint.keyframes.size()) << joint.why_no_uncertainty;
}

/// In two steps: navigation first, whose poses are then odometry.
Estimate in_two_steps(const Scenario& scenario) {
  Scenario with_odometry = navigated(scenario).scenario;
  with_odometry.data.ego.reset();
  with_odometry.navigation.reset();
  TrackingNoise& noise = with_odometry.data.noise;
  noise.prior = Vector<6>::Constant(1e-2);
  noise.odometry = (Vector<6>() << 0.02, 0.02, 0.02, 1e-3, 1e-3, 1e-3).finished();
  return estimate(with_odometry, {}, GaussNewtonOptions{});
}

TEST(StatisticalJointEstimate, IsNoWorseThanTwoSteps) {
  double joint = 0, two_steps = 0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Scenario scenario = dive_with_target({.grade = Grade::mems, .minutes = 2, .seed = seed}, 0.3);
    const Estimate together = estimate(scenario, {}, GaussNewtonOptions{});
    ASSERT_TRUE(together.summary.converged());
    joint += mean_position_error(together) / 3;
    two_steps += mean_position_error(in_two_steps(scenario)) / 3;
  }
  EXPECT_LE(joint, 1.02 * two_steps);
  EXPECT_LE(joint, 0.3) << "one fix is 0.5 m off, on average";
}

TEST(JointEstimate, AGapOfTheImuSplitsTheChainAndTheEstimateGoesOn) {
  Scenario scenario = dive_with_target({.grade = Grade::tactical, .minutes = 1}, 0.3);
  std::erase_if(scenario.navigation->imu->samples, [](const ImuSample& s) { return s.t > 30.3 && s.t < 33.8; });
  const Estimate joint = estimate(scenario, {}, GaussNewtonOptions{});
  ASSERT_TRUE(joint.summary.converged());
  ASSERT_FALSE(joint.splits.empty());
  EXPECT_LE(joint.splits.front().first, 30.3);
  EXPECT_GE(joint.splits.back().second, 33.8 - 0.5);
  for (const EgoSensorUse& sensor : joint.ego_sensors) EXPECT_EQ(sensor.left_out, 0u) << sensor.name;
  EXPECT_THAT(joint.findings.front().text(), HasSubstr("imu"));
  EXPECT_LE(mean_position_error(joint), 0.48) << "one fix is as far off, on average";
}

TEST(JointEstimate, DvlAndHeadingWithoutImu) {
  Scenario scenario = dive_with_target({.grade = Grade::tactical, .minutes = 1}, 0.3);
  scenario.navigation->imu.reset();
  const Estimate joint = estimate(scenario, {}, GaussNewtonOptions{});
  ASSERT_TRUE(joint.summary.converged());
  for (const EgoSensorUse& sensor : joint.ego_sensors) EXPECT_EQ(sensor.left_out, 0u) << sensor.name;
  EXPECT_LE(mean_position_error(joint), 1.0) << "half a degree of heading at the vessel's distance of 100 m";
}

/// All models that take a target's positions alone.
TEST(JointEstimate, AnyModelOfTheTarget) {
  const Scenario scenario = navigated(dive_with_target({.grade = Grade::tactical, .minutes = 1}, 0.3)).scenario;
  for (const MotionModel model : {MotionModel::constant_velocity, MotionModel::white_noise_acceleration}) {
    TrackingOptions options;
    options.model = model;
    const Estimate joint = estimate(scenario, options, GaussNewtonOptions{});
    EXPECT_TRUE(joint.summary.converged()) << name(model);
    EXPECT_LE(mean_position_error(joint), 0.4) << name(model);
  }
  TrackingOptions limited;
  limited.surge = Bounds<1>{Vector<1>(0.0), Vector<1>(3.0)};
  EXPECT_TRUE(estimate(scenario, limited, AugmentedLagrangianOptions{}).summary.converged());
}

TEST(JointEstimate, FixesOutsideTheChasersMotionAreLeftOut) {
  Scenario scenario = dive_with_target({.grade = Grade::tactical, .minutes = 1}, 0.3);
  Measurement early = scenario.data.sensors[0].measurements.front(), late = early;
  early.t = -0.5;
  late.t = 61.0;
  auto& fixes = scenario.data.sensors[0].measurements;
  fixes.insert(fixes.begin(), early);
  fixes.push_back(late);
  const Estimate joint = estimate(scenario, {}, GaussNewtonOptions{});
  EXPECT_TRUE(joint.summary.converged());
  EXPECT_EQ(joint.sensors[0].left_out, 2);
  EXPECT_EQ(joint.keyframes.front().t, 0);
}

TEST(JointEstimate, WhatCannotBe) {
  Scenario scenario = dive_with_target({.grade = Grade::tactical, .minutes = 1}, 0.3);
  const auto refusal = [](const Scenario& s) { return error_of([&] { estimate(s, {}, GaussNewtonOptions{}); }); };
  Scenario still = scenario;
  still.navigation->imu.reset();
  std::erase_if(still.navigation->sensors, [](const EgoSensor& s) { return s.type == EgoSensorType::dvl; });
  EXPECT_THAT(refusal(still),
              HasSubstr("navigation needs a source of motion: an imu, or a dvl together with a heading"));
  Scenario planar = navigated(scenario).scenario;
  planar.data.planar = true;
  EXPECT_THAT(refusal(planar), HasSubstr("a planar problem takes odometry"));
  scenario.data.sensors[0].measurements.clear();
  EXPECT_THAT(refusal(scenario), HasSubstr("needs relative measurements"));
}

}  // namespace
}  // namespace tandem
