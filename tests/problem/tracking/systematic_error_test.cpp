#include <cmath>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/gauss_newton.hpp>

namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kBias = 0.8;  // m

/// Returns data of a target at rest, 5 m ahead of a chaser at rest, and two position sensors. The first one has a bias
/// along y and less noise.
TrackingData two_sensors(double bias) {
  TrackingData data;
  data.noise.prior = data.noise.odometry = Vector<6>::Constant(1e-3);
  data.noise.constant_twist = Vector<6>::Constant(0.05);
  data.odometry = {{0.0, SE3()}, {60.0, SE3()}};
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal(0, 0.05);
  for (const bool off : {true, false}) {
    TargetSensor sensor{.name = off ? "off" : "right", .sigma = Vector<3>::Constant(off ? 0.05 : 0.3)};
    for (int t = 0; t <= 60; ++t)
      sensor.measurements.push_back({.t = double(t), .position = Vector<3>(5, off ? bias + normal(random) : 0.0, 0)});
    data.sensors.push_back(sensor);
  }
  return data;
}

double y_of_target(const TrackingData& data) {
  TrackingProblem tracking = make_tracking_problem(data);
  EXPECT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
  return tracking.target_state(30).position.y();
}

TEST(SystematicError, EstimatesConstantBias) {
  TrackingData data = two_sensors(kBias);
  EXPECT_NEAR(y_of_target(data), kBias, 0.05) << "without a bias state, the sensor with less noise dominates";
  data.sensors[0].error = SystematicError{Vector<3>::Constant(2)};
  EXPECT_NEAR(y_of_target(data), 0, 0.05);
}

TEST(SystematicError, ConstantBiasHasOneState) {
  TrackingData data = two_sensors(kBias);
  const TrackingProblem without = make_tracking_problem(data);
  data.sensors[0].error = SystematicError{Vector<3>::Constant(2)};
  const TrackingProblem constant = make_tracking_problem(data);
  EXPECT_EQ(constant.problem.num_soft_blocks(), without.problem.num_soft_blocks() + 1);
  data.sensors[0].error->correlation_time = 20;
  const TrackingProblem drifting = make_tracking_problem(data);
  EXPECT_EQ(drifting.problem.num_soft_blocks(), without.problem.num_soft_blocks() + 61);
  const auto of_errors = std::count_if(drifting.noise_blocks.begin(), drifting.noise_blocks.end(),
                                       [](const NoiseBlock& b) { return b.noise == "off.error"; });
  EXPECT_EQ(of_errors, 61);
}

TEST(SystematicError, ShortCorrelationTimeActsAsNoise) {
  TrackingData data = two_sensors(kBias);
  data.sensors[0].error = SystematicError{Vector<3>::Constant(2), 20};
  EXPECT_NEAR(y_of_target(data), 0, 0.1);
  // With a short correlation time, the bias acts as noise, and the fixes of the sensor contribute again.
  data.sensors[0].error = SystematicError{Vector<3>::Constant(0.05), 0.01};
  EXPECT_GT(y_of_target(data), 0.5 * kBias);
}

TEST(SystematicError, SupportsPoseSensor) {
  TrackingData data = two_sensors(0);
  TargetSensor camera{.name = "camera", .type = SensorType::pose, .sigma = Vector<6>::Constant(0.01)};
  for (int t = 0; t < 60; ++t)
    camera.measurements.push_back({.t = t + 0.5, .position = Vector<3>(5, 0, 0), .rotation = SO3::Exp({0, 0, 0.1})});
  camera.error = SystematicError{Vector<6>::Constant(0.2)};
  data.sensors.push_back(camera);
  TrackingProblem tracking = make_tracking_problem(data);
  EXPECT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
}

TEST(SystematicError, RejectsInvalidValues) {
  const auto expect_rejected = [](const TrackingData& data, const TrackingOptions& options, const char* reason) {
    EXPECT_THAT([&] { make_tracking_problem(data, options); }, ThrowsMessage<Error>(HasSubstr(reason)));
  };
  TrackingData data = two_sensors(0);
  data.sensors[0].error = SystematicError{Vector<3>::Constant(2)};
  data.sensors[0].error->bias_sigma = Vector<2>(1, 1);
  expect_rejected(data, {}, "off.error needs 3 standard deviations");
  data.sensors[0].error->bias_sigma = Vector<3>(1, 1, 0);
  expect_rejected(data, {}, "off.error: the standard deviations of the bias must be positive");
  data.sensors[0].error = SystematicError{.scale_sigma = std::numeric_limits<double>::quiet_NaN()};
  expect_rejected(data, {}, "off.error: the standard deviation of the scale must be zero or positive, and finite");
  data.sensors[0].error = SystematicError{.misalignment_sigma = -0.1};
  expect_rejected(data, {}, "of the misalignment");
  data.sensors[0].error = SystematicError{Vector<3>::Constant(2), std::numeric_limits<double>::quiet_NaN()};
  expect_rejected(data, {}, "the correlation time must be positive");
}

}  // namespace
}  // namespace tandem::testing
