#include <algorithm>
#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/residuals/damped_twist.hpp>
#include <tandem/residuals/gauss_markov.hpp>
#include <tandem/studies/calibration/calibrate_scenarios.hpp>
#include <tandem/studies/calibration/calibration_report.hpp>
#include <tandem/studies/calibration/model_parameters.hpp>

namespace tandem {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

constexpr double kTime = 4, kErrorTime = 15;  // time constant of the twist, correlation time of the error [s]

/// A planar target that moves by the damped twist model, measured each second from a chaser at rest. Optionally with a
/// time-correlated error of the camera (`error`), or with Student's t noise (`dof`).
Scenario damped_target(unsigned seed, int seconds, double motion = 1, bool error = false, double dof = 0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto three = [&] { return Vector<3>{normal(random), normal(random), normal(random)}; };
  Scenario scenario;
  scenario.name = "damped";
  TrackingData& data = scenario.data;
  data.planar = true;
  data.noise = TrackingNoise(true);
  data.noise.prior.setConstant(1e-3);
  data.noise.odometry.setConstant(1e-4);
  data.noise.constant_twist = motion * Vector<3>(0.3, 0.2, 0.1);
  data.noise.twist_time.setConstant(kTime);
  TargetSensor camera{.name = "camera", .type = SensorType::pose, .sigma = Vector<3>(0.05, 0.05, 0.02)};
  if (error) camera.error = SystematicError{Vector<3>(0.3, 0.3, 0.1), kErrorTime};
  if (dof > 0) camera.loss = StudentT(dof, 3);
  const Vector<3> sigma = data.noise.constant_twist, camera_sigma = camera.sigma;
  const Vector<3> spread = DampedTwist<SE2>::noise_scale(1, 1, data.noise.twist_time);
  const double decay = std::exp(-1 / kTime);
  Vector<3> twist = std::sqrt(kTime / 2) * sigma.cwiseProduct(three()),
            bias = Vector<3>(0.3, 0.3, 0.1).cwiseProduct(three());
  const auto step = GaussMarkov<3>::after(1, kErrorTime);
  SE2 target(SO2(0.3), Vector<2>(5, 2));
  for (int t = 0; t <= seconds; ++t) {
    data.odometry.push_back({double(t), SE3()});
    std::chi_squared_distribution<double> chi(std::max(dof, 1.0));
    // The given noise is that of the Gaussian with the curvature of the peak.
    const double stretch = dof > 0 ? std::sqrt((dof + 3) / chi(random)) : 1.0;
    Vector<3> noise = stretch * camera_sigma.cwiseProduct(three());
    if (error) noise += bias;
    const SE3 pose = in_space(target * SE2::Exp(noise));
    camera.measurements.push_back({.t = double(t), .position = pose.translation(), .rotation = pose.rotation()});
    target = target * SE2::Exp(twist);
    twist = (decay * twist + sigma.cwiseProduct(spread).cwiseProduct(three())).eval();
    bias = (step.decay * bias + step.noise_scale() * Vector<3>(0.3, 0.3, 0.1).cwiseProduct(three())).eval();
  }
  data.sensors = {camera};
  return scenario;
}

ScenarioCalibrationOptions options_for(std::vector<std::string> free, int folds = 0) {
  ScenarioCalibrationOptions options;
  options.free = std::move(free);
  options.target.model = MotionModel::damped_twist;
  options.target.roll_pitch = Role::off;
  options.folds = folds;
  return options;
}

std::string rejection(const Scenario& scenario, const ScenarioCalibrationOptions& options) {
  try {
    calibrate_scenarios({scenario}, options);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(StatisticalModelParameters, RecoversTheTimeConstantsOfTheTwist) {
  constexpr int kSeeds = 6;
  double mean = 0, furthest = 0;
  int within = 0;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    Scenario scenario = damped_target(seed, 1200);
    scenario.data.noise.twist_time.setConstant(10);
    const ScenarioCalibration found = calibrate_scenarios({scenario}, options_for({"twist_time", "constant_twist"}));
    ASSERT_THAT(found.parameters, SizeIs(6));
    for (std::size_t i = 3; i < 6; ++i) {
      const CalibratedParameter& p = found.parameters[i];
      EXPECT_TRUE(p.result.identifiable) << p.name;
      const double off = std::log(p.found() / kTime);
      mean += off / (3 * kSeeds);
      furthest = std::max(furthest, std::abs(off));
      within += std::abs(off) <= 2 * p.result.log_error;
    }
  }
  EXPECT_LE(std::abs(mean), 0.05);
  EXPECT_LE(furthest, 0.35);
  EXPECT_GE(within, 0.8 * 3 * kSeeds);
  RecordProperty("times", std::to_string(mean) + " " + std::to_string(furthest) + " " + std::to_string(within));
}

TEST(LongModelParameters, RecommendsTheTrueCorrelationTime) {
  Scenario scenario = damped_target(1, 400, 0.03, true);
  scenario.data.sensors[0].error->correlation_time = 1.5;
  const ScenarioCalibration found = calibrate_scenarios({scenario}, options_for({"camera.time"}, 3));
  ASSERT_THAT(found.parameters, SizeIs(1));
  EXPECT_EQ(found.parameters[0].given, 1.5);
  EXPECT_NEAR(std::log(found.parameters[0].found() / kErrorTime), 0, 0.8);
  EXPECT_TRUE(found.recommended()) << report(found);
  ASSERT_THAT(found.noise, SizeIs(1));
  EXPECT_EQ(found.noise[0].name, "camera.time");
  EXPECT_THAT(found.noise[0].sigmas, ElementsAre(found.parameters[0].found()));
  EXPECT_THAT(found.given_noise[0].sigmas, ElementsAre(1.5));
  EXPECT_THAT(report(found), HasSubstr("camera.time"));
}

TEST(LongModelParameters, CalibratesDegreesOfFreedomWithTheNoise) {
  Scenario scenario = damped_target(2, 600, 0.03, false, 3);
  scenario.data.sensors[0].loss = StudentT(20, 3);
  const ScenarioCalibration found = calibrate_scenarios({scenario}, options_for({"camera", "camera.dof"}, 2));
  ASSERT_THAT(found.parameters, SizeIs(4));
  EXPECT_EQ(found.parameters[3].name, "camera.dof");
  EXPECT_NEAR(found.parameters[3].given, 20, 1e-9);
  EXPECT_NEAR(std::log(found.parameters[3].found() / 3), 0, 0.5);
  EXPECT_TRUE(found.recommended()) << report(found);
  ASSERT_THAT(found.noise, SizeIs(2));
  EXPECT_EQ(found.noise[1].name, "camera.dof");
}

TEST(ModelParameters, CalibratesASingleComponent) {
  Scenario scenario = damped_target(3, 200);
  scenario.data.noise.twist_time = Vector<3>(4, 5, 9);
  const ScenarioCalibration found = calibrate_scenarios({scenario}, options_for({"twist_time.yaw"}));
  ASSERT_THAT(found.noise, SizeIs(1));
  EXPECT_EQ(found.noise[0].name, "twist_time");
  EXPECT_THAT(found.noise[0].sigmas, ElementsAre(4, 5, found.parameters[0].found()));
  EXPECT_NE(found.parameters[0].found(), 9);
  EXPECT_GT(found.summary.iterations, 0);
  EXPECT_GT(found.summary.solves, 10);
  EXPECT_THAT(report(found), HasSubstr(", " + std::to_string(found.summary.solves) + " solves"));
  EXPECT_THAT(found.summary.message, HasSubstr("problems were built"));
}

TEST(ModelParameters, VelocityTimesAreInTheAxesOfTheFiles) {
  Scenario scenario = damped_target(3, 20);
  scenario.data.planar = false;
  scenario.data.noise = TrackingNoise();
  scenario.data.noise.velocity_time = Vector<3>(1, 2, 3);  // east, north, up
  scenario.frame = Frame::ned_frd();
  TrackingOptions options;
  options.model = MotionModel::damped_velocity;
  std::vector<std::string> free = {"velocity_time", "camera"};
  const auto numbers = take_model_parameters(scenario, options, {}, free);
  EXPECT_THAT(free, ElementsAre("camera"));
  ASSERT_THAT(numbers, SizeIs(3));
  EXPECT_EQ(numbers[0].name, "velocity_time.x");
  EXPECT_EQ(numbers[0].given, 2) << "north";
  const auto entries = entries_of(numbers, scenario);
  ASSERT_THAT(entries, SizeIs(1));
  EXPECT_THAT(entries[0].sigmas, ElementsAre(2, 1, 3));
  numbers[0].set(scenario, 7);
  EXPECT_EQ(scenario.data.noise.velocity_time, Eigen::VectorXd(Vector<3>(1, 7, 3)));
}

/// The noise is then calibrated again with the given time constant.
TEST(LongModelParameters, KeepsATimeConstantThatRunsToTheLimit) {
  Scenario scenario = damped_target(4, 400);
  scenario.data.noise.twist_time[2] = kTime / 4000;
  ScenarioCalibrationOptions options = options_for({"camera", "twist_time.yaw"}, 2);
  options.prior = 0;
  const ScenarioCalibration found = calibrate_scenarios({scenario}, options);
  ASSERT_THAT(found.parameters, SizeIs(4));
  EXPECT_EQ(found.parameters[3].name, "twist_time.yaw");
  EXPECT_EQ(found.parameters[3].keep_reason, KeepReason::at_limit);
  EXPECT_EQ(found.parameters[3].found(), kTime / 4000);
  EXPECT_THAT(report(found), HasSubstr("ran to the limit"));
  EXPECT_EQ(found.noise.back().sigmas[2], kTime / 4000);
  EXPECT_EQ(found.summary.noise.size(), 3u);
  const ScenarioCalibration again = calibrate_scenarios({scenario}, options_for({"camera"}));
  EXPECT_GT(found.summary.solves, again.summary.solves + 10) << "includes the solves for the time constant";
}

/// Constants are estimated with the recommended time constant.
TEST(LongModelParameters, CrossValidatesConstantsTogetherWithATimeConstant) {
  Scenario scenario = damped_target(6, 200);
  scenario.data.sensors[0].error.emplace().delay_sigma = 0.3;
  for (const double given : {kTime, 0.5}) {
    scenario.data.noise.twist_time[0] = given;
    const ScenarioCalibration found = calibrate_scenarios({scenario}, options_for({"twist_time.x"}, 2));
    ASSERT_THAT(found.parameters, SizeIs(1));
    EXPECT_EQ(found.recommended(), given != kTime) << report(found);
    scenario.data.noise.twist_time[0] = found.noise[0].sigmas[0];
    ScenarioCalibrationOptions alone = options_for({}, 2);
    alone.noise = false;
    const ScenarioCalibration constants = calibrate_scenarios({scenario}, alone);
    ASSERT_THAT(found.constants, SizeIs(1)) << report(found);
    const SystematicErrorEstimate &a = found.constants[0].found, &b = constants.constants.at(0).found;
    EXPECT_EQ(a.name, "camera.delay");
    EXPECT_NEAR(a.value, b.value, 1e-5);
    ASSERT_TRUE(a.held_out && b.held_out);
    EXPECT_NEAR(a.held_out->gain, b.held_out->gain, 1e-3);
    EXPECT_NEAR(a.held_out->error, b.held_out->error, 1e-3);
  }
}

TEST(ModelParameters, ReturnsTheBestSoFarWhenStopped) {
  Scenario scenario = damped_target(4, 200);
  scenario.data.noise.twist_time.setConstant(30);
  std::atomic<bool> stop = false;
  ScenarioCalibrationOptions options = options_for({"twist_time.yaw"}, 3);
  options.stop = Stop(&stop);
  options.progress = [&stop](const std::string&) { stop = true; };
  const ScenarioCalibration found = calibrate_scenarios({scenario}, options);
  EXPECT_TRUE(found.cut_short);
  EXPECT_FALSE(found.summary.converged());
  ASSERT_THAT(found.parameters, SizeIs(1));
  EXPECT_LT(found.parameters[0].found(), 30);
  EXPECT_EQ(found.noise[0].sigmas[2], 30) << "only validated values are written";
}

TEST(ModelParameters, RejectsParametersThatTheScenarioLacks) {
  const Scenario scenario = damped_target(5, 60);
  ScenarioCalibrationOptions options = options_for({"twist_time"});
  options.target.model = MotionModel::constant_twist;
  EXPECT_THAT(rejection(scenario, options), AllOf(HasSubstr("--free twist_time"), HasSubstr("--model damped-twist")));
  options = options_for({"velocity_time.x"});
  EXPECT_THAT(rejection(scenario, options), HasSubstr("--mode B"));
  EXPECT_THAT(rejection(scenario, options_for({"camera.time"})), HasSubstr("--error camera="));
  EXPECT_THAT(rejection(scenario, options_for({"camera.dof"})), HasSubstr("--loss camera=student-t:3"));
  EXPECT_THAT(rejection(scenario, options_for({"camera.tim"})),
              AllOf(HasSubstr("'camera.tim'; did you mean camera.time?"), HasSubstr("twist_time (x, y, yaw)")));
  EXPECT_THAT(rejection(scenario, options_for({"twst_time.x"})), HasSubstr("did you mean twist_time.x?"));
  Scenario robust = scenario;
  robust.data.sensors[0].loss = Cauchy(2);
  EXPECT_THAT(rejection(robust, options_for({"camera.dof"})),
              HasSubstr("the loss cauchy:2 of camera has no degrees of freedom"));
  robust.data.sensors[0].loss = StudentT(3, 3);
  EXPECT_THAT(rejection(robust, options_for({"camera.dof"})), HasSubstr("the estimated states absorb"));
  robust.data.sensors[0].loss = Loss{Loss::Kind::student_t, 1};
  EXPECT_THAT(rejection(robust, options_for({"camera.dof"})), HasSubstr("must be above 1.73"));
}

}  // namespace
}  // namespace tandem
