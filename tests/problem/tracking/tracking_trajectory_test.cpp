#include <numbers>

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
  const auto covariance = [&](const Eigen::MatrixXd& J, const std::vector<int>& ids, const std::vector<int>& dofs) {
    return marginals.propagated(J, ids, dofs);
  };
  const TrackingTrajectory trajectory(tracking, data, options);
  for (const double t : {trajectory.first(), 1.3, 3.2, 3.5, 5.0, 8.7, trajectory.last()}) {
    SCOPED_TRACE(t);
    const TrackedInstant state = trajectory.at(t, covariance);
    EXPECT_LE(minus(SE3(*state.chaser.rotation, state.chaser.position), run.chaser(state.t)).norm(), 2e-3);
    EXPECT_LE((state.target.position - run.target(state.t).translation()).norm(), c.turning ? 0.02 : 2e-3);
    const Eigen::VectorXd& twist = state.target.twist;
    if (state.target.rotation) EXPECT_LE(minus(*state.target.rotation, run.target(state.t).rotation()).norm(), 1e-2);
    EXPECT_NEAR(twist.head(c.planar ? 2 : 3).norm(), 0.9, 0.02);
    ASSERT_EQ(state.target.covariance.rows(), 2 * twist.size());
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(state.target.covariance).eigenvalues().minCoeff(), -1e-9);
    ASSERT_EQ(state.chaser.covariance.rows(), c.planar ? 6 : 12);
  }
  EXPECT_TRUE(trajectory.at(1.3).target.covariance.size() == 0);
  EXPECT_THAT([&] { trajectory.at(99.0); },
              ThrowsMessage<BadInputError>(HasSubstr("the time 99.000000 s is outside the trajectory")));
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

/// Compares interpolated states with those of a problem that has a keyframe at each of the instants. The chaser's
/// heading is almost exact, so that its motion is linear.
void expect_equal_to_keyframes(TrackingData data, const TrackingOptions& options, double tolerance,
                               double relative_covariance) {
  for (Eigen::VectorXd* sigma : {&data.noise.prior, &data.noise.odometry})
    sigma->tail(data.planar ? 1 : 3).setConstant(1e-6);
  TrackingData refined = data;
  refined.keyframe_interval = 0.5 * data.keyframe_interval;
  TrackingProblem sparse = make_tracking_problem(data, options), dense = make_tracking_problem(refined, options);
  ASSERT_GT(dense.keyframes.size(), 1.5 * double(sparse.keyframes.size()));
  for (TrackingProblem* tracking : {&sparse, &dense})
    ASSERT_TRUE(solve(tracking->problem, GaussNewtonOptions{}).converged());
  const Marginals of_sparse(sparse.problem), of_dense(dense.problem);
  const auto propagate = [&](const Eigen::MatrixXd& J, const std::vector<int>& ids, const std::vector<int>& dofs) {
    return of_sparse.propagated(J, ids, dofs);
  };
  const TrackingTrajectory trajectory(sparse, data, options);
  for (std::size_t k = 0; k < dense.keyframes.size(); ++k) {
    SCOPED_TRACE(dense.keyframes[k].t);
    const TrackedInstant instant = trajectory.at(dense.keyframes[k].t, propagate);
    EXPECT_LE((instant.target.position - dense.target_state(k).position).norm(), tolerance);
    const SE3 chaser(*instant.chaser.rotation, instant.chaser.position);
    EXPECT_LE(minus(chaser, dense.chaser_pose(k)).norm(), tolerance);
    const Eigen::MatrixXd expected =
        std::visit([&](const auto& x) -> Eigen::MatrixXd { return of_dense.covariance(x); }, dense.chaser[k]);
    EXPECT_LE((instant.chaser.covariance.topLeftCorner(expected.rows(), expected.cols()) - expected).norm(),
              relative_covariance * expected.norm());
  }
}

/// With white noise on acceleration, the interpolation is the posterior of a problem that has a keyframe there.
TEST(TrackingTrajectory, WhiteNoiseEqualsAKeyframeWithoutMeasurement) {
  const SimulatedRun run{.planar = true, .target_twist = twist(0.9, 0.0)};
  TrackingData data = run.data({{.name = "sonar", .type = SensorType::position}}, every(1.0, 0.0, run.duration));
  data.keyframe_interval = 1.0;
  expect_equal_to_keyframes(data, {.model = MotionModel::white_noise_acceleration}, 1e-4, 1e-2);
}

/// Between keyframes the chaser follows the odometry, also where that turns within the interval.
TEST(TrackingTrajectory, ChaserFollowsItsOdometryBetweenKeyframes) {
  for (const bool planar : {true, false}) {
    SCOPED_TRACE(planar);
    SimulatedRun run{.planar = planar, .target_twist = twist(0.9, 0.0)};
    TrackingData data = run.data({{.name = "sonar", .type = SensorType::position}}, every(2.0, 0.0, run.duration));
    for (Stamped<SE3>& pose : data.odometry)  // a slalom of 2 s, which is zero at every keyframe
      pose.value = pose.value * SE3::Exp(twist(0, 0.3) * std::sin(std::numbers::pi * pose.t) +
                                         twist(0.4, 0) * std::sin(2 * std::numbers::pi * pose.t));
    Measurement& moved = data.sensors[0].measurements[3];
    moved.position += Vector<3>(0.3, -0.2, 0.0);
    data.keyframe_interval = 2.0;
    expect_equal_to_keyframes(data, {.model = MotionModel::white_noise_acceleration}, 2e-3, 2e-2);
  }
}

}  // namespace
}  // namespace tandem::testing
