#include <Eigen/Eigenvalues>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/tracking/tracking_trajectory.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>

#include "simulated_run.hpp"

namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

struct TrajectoryCase {
  MotionModel model;
  Mode mode;
  bool planar, turning;
};

class TrackingTrajectoryOf : public ::testing::TestWithParam<TrajectoryCase> {};

/// The truth has constant twists, which every interpolation reproduces between exact keyframes.
TEST_P(TrackingTrajectoryOf, FollowsConstantTwists) {
  const TrajectoryCase& c = GetParam();
  SimulatedRun run{.planar = c.planar, .target_twist = twist(0.9, c.turning ? 0.06 : 0.0)};
  const TrackingOptions options{.model = c.model, .mode = c.mode};
  TrackingData data = run.data({{.name = "sonar", .type = SensorType::position}}, every(0.8, 0.0, run.duration));
  data.sensors.push_back(run.data({{.name = "camera", .type = SensorType::pose}}, {3.2, 8.8}).sensors[0]);
  data.noise.twist_time.setConstant(1e13);
  data.noise.velocity_time.setConstant(1e13);
  TrackingProblem tracking = make_tracking_problem(data, options);
  ASSERT_TRUE(solve(tracking.problem, GaussNewtonOptions{}).converged());
  const Marginals marginals(tracking.problem);
  const auto covariance = [&](const std::vector<int>& ids, const std::vector<int>& dofs) {
    return marginals.joint(ids, dofs);
  };
  const TrackingTrajectory trajectory(tracking, data.noise, options);
  const std::vector<double> times{trajectory.first(), 1.3, 3.2, 3.5, 5.0, 8.7, trajectory.last()};
  const std::vector<TrackedInstant> states = trajectory.at(times, covariance);
  ASSERT_EQ(states.size(), times.size());
  for (const TrackedInstant& state : states) {
    SCOPED_TRACE(state.t);
    EXPECT_LE(minus(state.chaser, run.chaser(state.t)).norm(), 2e-3);
    EXPECT_LE((state.target.position - run.target(state.t).translation()).norm(), c.turning ? 0.02 : 2e-3);
    const Eigen::VectorXd& twist = state.target_twist;
    if (state.target.rotation) EXPECT_LE(minus(*state.target.rotation, run.target(state.t).rotation()).norm(), 1e-2);
    EXPECT_NEAR(twist.head(c.planar ? 2 : 3).norm(), 0.9, 0.02);
    ASSERT_EQ(state.target_covariance.rows(), 2 * twist.size());
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(state.target_covariance).eigenvalues().minCoeff(), -1e-9);
    ASSERT_EQ(state.chaser_covariance.rows(), c.planar ? 6 : 12);
  }
  EXPECT_TRUE(trajectory.at(times)[1].target_covariance.size() == 0);
  const std::vector<double> late{1.0, 99.0};
  EXPECT_THAT([&] { trajectory.at(late); },
              ThrowsMessage<BadInputError>(HasSubstr("the time 99.000000 s is outside of the trajectory")));
}

INSTANTIATE_TEST_SUITE_P(All, TrackingTrajectoryOf,
                         ::testing::Values(TrajectoryCase{MotionModel::constant_twist, Mode::A, false, true},
                                           TrajectoryCase{MotionModel::constant_twist, Mode::A, true, true},
                                           TrajectoryCase{MotionModel::constant_twist, Mode::B, false, false},
                                           TrajectoryCase{MotionModel::constant_velocity, Mode::A, false, false},
                                           TrajectoryCase{MotionModel::damped_twist, Mode::A, false, true},
                                           TrajectoryCase{MotionModel::damped_velocity, Mode::A, true, false},
                                           TrajectoryCase{MotionModel::white_noise_acceleration, Mode::A, false, true},
                                           TrajectoryCase{MotionModel::white_noise_acceleration, Mode::A, true, true}));

/// With white noise on acceleration, the interpolation is the posterior of a problem that has a keyframe there.
TEST(TrackingTrajectory, WhiteNoiseEqualsAKeyframeWithoutMeasurement) {
  const SimulatedRun run{.planar = true, .target_twist = twist(0.9, 0.0)};
  const TrackingOptions options{.model = MotionModel::white_noise_acceleration};
  TrackingData data = run.data({{.name = "sonar", .type = SensorType::position}}, every(1.0, 0.0, run.duration));
  data.keyframe_interval = 1.0;
  TrackingProblem sparse = make_tracking_problem(data, options);
  data.keyframe_interval = 0.5;
  TrackingProblem dense = make_tracking_problem(data, options);
  ASSERT_GT(dense.keyframes.size(), sparse.keyframes.size() + 8);
  for (TrackingProblem* tracking : {&sparse, &dense})
    ASSERT_TRUE(solve(tracking->problem, GaussNewtonOptions{}).converged());
  const TrackingTrajectory trajectory(sparse, data.noise, options);
  for (std::size_t k = 0; k < dense.keyframes.size(); ++k) {
    const std::vector<double> time{dense.keyframes[k].t};
    EXPECT_LE((trajectory.at(time)[0].target.position - dense.target_state(k).position).norm(), 1e-4) << time[0];
  }
}

}  // namespace
}  // namespace tandem::testing
