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

/// A target at rest 5 m ahead of a chaser at rest; two position sensors, of which the first reads too much along y.
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

TEST(StayingError, AConstantOneIsEstimated) {
  TrackingData data = two_sensors(kBias);
  EXPECT_NEAR(y_of_target(data), kBias, 0.05) << "the sensor of less noise wins";
  data.sensors[0].error = StayingError{Vector<3>::Constant(2)};
  EXPECT_NEAR(y_of_target(data), 0, 0.05);
}

TEST(StayingError, OneStateForAllWhereItIsConstantElseOneEach) {
  TrackingData data = two_sensors(kBias);
  const TrackingProblem without = make_tracking_problem(data);
  data.sensors[0].error = StayingError{Vector<3>::Constant(2)};
  const TrackingProblem constant = make_tracking_problem(data);
  EXPECT_EQ(constant.problem.num_soft_blocks(), without.problem.num_soft_blocks() + 1);
  data.sensors[0].error->time = 20;
  const TrackingProblem drifting = make_tracking_problem(data);
  EXPECT_EQ(drifting.problem.num_soft_blocks(), without.problem.num_soft_blocks() + 61);
  const auto of_errors = std::count_if(drifting.noised.begin(), drifting.noised.end(),
                                       [](const NoisedBlock& b) { return b.noise == "off.error"; });
  EXPECT_EQ(of_errors, 61);
}

TEST(StayingError, OneThatIsForgottenIsHalfBelieved) {
  TrackingData data = two_sensors(kBias);
  data.sensors[0].error = StayingError{Vector<3>::Constant(2), 20};
  EXPECT_NEAR(y_of_target(data), 0, 0.1);
  // A short memory is noise: the fixes of the sensor count again.
  data.sensors[0].error = StayingError{Vector<3>::Constant(0.05), 0.01};
  EXPECT_GT(y_of_target(data), 0.5 * kBias);
}

TEST(StayingError, OfAPose) {
  TrackingData data = two_sensors(0);
  TargetSensor camera{.name = "camera", .type = SensorType::pose, .sigma = Vector<6>::Constant(0.01)};
  for (int t = 0; t < 60; ++t)
    camera.measurements.push_back({.t = t + 0.5, .position = Vector<3>(5, 0, 0), .rotation = SO3::Exp({0, 0, 0.1})});
  camera.error = StayingError{Vector<6>::Constant(0.2)};
  data.sensors.push_back(camera);
  TrackingProblem tracking = make_tracking_problem(data);
  EXPECT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
}

TEST(StayingError, SaysWhereItCannotBe) {
  const auto refused = [](const TrackingData& data, const TrackingOptions& options, const char* why) {
    EXPECT_THAT([&] { make_tracking_problem(data, options); }, ThrowsMessage<Error>(HasSubstr(why)));
  };
  TrackingData data = two_sensors(0);
  data.sensors[0].error = StayingError{Vector<3>::Constant(2)};
  data.sensors[0].error->sigma = Vector<2>(1, 1);
  refused(data, {}, "off.error needs 3 standard deviations");
  data.sensors[0].error->sigma = Vector<3>(1, 1, 0);
  refused(data, {}, "above zero");
  data.sensors[0].error = StayingError{.scale = std::numeric_limits<double>::quiet_NaN()};
  refused(data, {}, "off.error: the standard deviation of its scale must be finite");
  data.sensors[0].error = StayingError{.misalignment = -0.1};
  refused(data, {}, "of its misalignment");
  data.sensors[0].error = StayingError{Vector<3>::Constant(2), std::numeric_limits<double>::quiet_NaN()};
  refused(data, {}, "its time must be above zero");
}

}  // namespace
}  // namespace tandem::testing
