#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/tracking/ego_track.hpp>
#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/navigation/navigated_scenario.hpp>
#include <tandem/studies/simulation/simulate_dive.hpp>

#include "studies/simulation/target_of_dive.hpp"

/// Joint estimation of chaser and target from raw sensor data, on a simulated dive with a simulated target.
namespace tandem {
namespace {

using testing::HasSubstr;

double mean_position_error(const Estimate& estimate) { return summarise(estimate.errors).position.value().mean; }

/// Returns the mean error of the target's position in the world [m].
double mean_target_error(const Estimate& estimate, const Scenario& scenario) {
  double sum = 0;
  for (std::size_t k = 0; k < estimate.keyframes.size(); ++k) {
    const auto truth = pose_at(scenario.truth_target, estimate.keyframes[k].t);
    sum += (estimate.target[k].position - truth->translation()).norm() / double(estimate.keyframes.size());
  }
  return sum;
}

TEST(JointEstimate, RecoversTruthWithoutNoise) {
  DiveOptions options{.grade = Grade::tactical, .minutes = 1};
  options.noise = false;
  const Scenario scenario = dive_with_target(options, 0.0);
  const Estimate joint = estimate(scenario, {}, GaussNewtonOptions{});
  ASSERT_TRUE(joint.summary.converged()) << joint.summary.message;
  // Remaining errors: the trapezoidal rule in the waves at the surface, and constant twist on the curve of the target.
  EXPECT_LE(mean_position_error(joint), 0.02);
  EXPECT_LE(mean_target_error(joint, scenario), 0.03);
  ASSERT_EQ(joint.ego_sensors.size(), 4u);
  for (const EgoSensorUse& sensor : joint.ego_sensors) {
    EXPECT_GT(sensor.used, 10u) << sensor.name;
    EXPECT_EQ(sensor.discarded, 0u) << sensor.name;
  }
  EXPECT_TRUE(joint.splits.empty());
  EXPECT_EQ(joint.uncertainty.size(), joint.keyframes.size()) << joint.why_no_uncertainty;
}

/// Estimates in two steps: navigates the chaser, then uses its poses as odometry.
Estimate in_two_steps(const Scenario& scenario) {
  Scenario with_odometry = navigated(scenario).scenario;
  with_odometry.data.ego.reset();
  with_odometry.navigation.reset();
  TrackingNoise& noise = with_odometry.data.noise;
  noise.prior = Vector<6>::Constant(1e-2);
  noise.odometry = (Vector<6>() << 0.02, 0.02, 0.02, 1e-3, 1e-3, 1e-3).finished();
  return estimate(with_odometry, {}, GaussNewtonOptions{});
}

TEST(StatisticalJointEstimate, IsAsAccurateAsTwoStepEstimate) {
  double joint = 0, two_steps = 0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Scenario scenario = dive_with_target({.grade = Grade::mems, .minutes = 2, .seed = seed}, 0.3);
    const Estimate together = estimate(scenario, {}, GaussNewtonOptions{});
    ASSERT_TRUE(together.summary.converged());
    joint += mean_position_error(together) / 3;
    two_steps += mean_position_error(in_two_steps(scenario)) / 3;
  }
  EXPECT_LE(joint, 1.02 * two_steps);
  EXPECT_LE(joint, 0.3) << "the mean error of a fix is 0.5 m";
}

TEST(JointEstimate, ContinuesAcrossImuGap) {
  Scenario scenario = dive_with_target({.grade = Grade::tactical, .minutes = 1}, 0.3);
  std::erase_if(scenario.navigation->imu->samples, [](const ImuSample& s) { return s.t > 30.3 && s.t < 33.8; });
  const Estimate joint = estimate(scenario, {}, GaussNewtonOptions{});
  ASSERT_TRUE(joint.summary.converged());
  ASSERT_FALSE(joint.splits.empty());
  EXPECT_LE(joint.splits.front().first, 30.3);
  EXPECT_GE(joint.splits.back().second, 33.8 - 0.5);
  for (const EgoSensorUse& sensor : joint.ego_sensors) EXPECT_EQ(sensor.discarded, 0u) << sensor.name;
  EXPECT_TRUE(std::any_of(joint.findings.begin(), joint.findings.end(),
                          [](const NavigationFinding& finding) { return finding.sensor == "imu"; }));
  EXPECT_LE(mean_position_error(joint), 0.48) << "the mean error of a fix";
}

TEST(JointEstimate, WorksWithoutImu) {
  Scenario scenario = dive_with_target({.grade = Grade::tactical, .minutes = 1}, 0.3);
  scenario.navigation->imu.reset();
  const Estimate joint = estimate(scenario, {}, GaussNewtonOptions{});
  ASSERT_TRUE(joint.summary.converged());
  for (const EgoSensorUse& sensor : joint.ego_sensors) EXPECT_EQ(sensor.discarded, 0u) << sensor.name;
  EXPECT_LE(mean_position_error(joint), 1.0) << "0.5° of heading error at a distance of 100 m";
}

/// All models for targets of which only positions are measured.
TEST(JointEstimate, WorksWithModelsOfPointTargets) {
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

TEST(JointEstimate, DiscardsFixesOutsideChaserData) {
  Scenario scenario = dive_with_target({.grade = Grade::tactical, .minutes = 1}, 0.3);
  Measurement early = scenario.data.sensors[0].measurements.front(), late = early;
  early.t = -0.5;
  late.t = 61.0;
  auto& fixes = scenario.data.sensors[0].measurements;
  fixes.insert(fixes.begin(), early);
  fixes.push_back(late);
  const Estimate joint = estimate(scenario, {}, GaussNewtonOptions{});
  EXPECT_TRUE(joint.summary.converged());
  EXPECT_EQ(joint.sensors[0].discarded, 2);
  EXPECT_EQ(joint.keyframes.front().t, 0);
}

TEST(JointEstimate, RejectsInvalidScenarios) {
  Scenario scenario = dive_with_target({.grade = Grade::tactical, .minutes = 1}, 0.3);
  const auto rejection = [](const Scenario& s) { return error_of([&] { estimate(s, {}, GaussNewtonOptions{}); }); };
  Scenario still = scenario;
  still.navigation->imu.reset();
  std::erase_if(still.navigation->sensors,
                [](const EgoSensor& s) { return s.type == EgoSensorType::dvl || s.type == EgoSensorType::gps; });
  EXPECT_THAT(rejection(still),
              HasSubstr("navigation needs a source of motion: add an imu, or a heading sensor with a dvl or a gps"));
  Scenario planar = navigated(scenario).scenario;
  planar.data.planar = true;
  EXPECT_THAT(rejection(planar), HasSubstr("a planar problem requires odometry"));
  scenario.data.sensors[0].measurements.clear();
  EXPECT_THAT(rejection(scenario), HasSubstr("needs relative measurements"));
}

}  // namespace
}  // namespace tandem
