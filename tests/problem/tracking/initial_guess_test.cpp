#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/tracking/tracking_initial_guess.hpp>
#include <tandem/residuals/direction.hpp>
#include <tandem/solvers/gauss_newton.hpp>

#include "simulated_run.hpp"

/// Initial guess of the target for all combinations of sensors.
namespace tandem::testing {
namespace {

class InitialGuess : public ::testing::TestWithParam<bool> {  // planar
 protected:
  SimulatedRun run{.planar = GetParam(), .duration = 40.0};

  static bool converges(TrackingProblem& tracking) { return solve(tracking.problem, GaussNewtonOptions{}).converged(); }
};

TEST_P(InitialGuess, BearingsSufficeForTurningChaser) {
  run.chaser_twist = (Vector<6>() << 1.4, 0.0, 0.0, 0.0, 0.0, 0.15).finished();
  run.target_twist = twist(0.5, 0.0);
  const TrackingData data = run.data({{.name = "camera", .type = SensorType::bearing}}, every(1.0, 0.0, 40.0));
  TrackingProblem tracking = make_tracking_problem(data, {.model = MotionModel::constant_velocity});
  EXPECT_LE(run.largest_error(tracking), 1.0);
  EXPECT_TRUE(converges(tracking));
  EXPECT_LE(run.largest_error(tracking), 1e-2);
}

/// If the chaser moves straight, bearings do not determine the range, and a target in the camera itself would fit best.
TEST_P(InitialGuess, TargetIsNeverInCamera) {
  run.target_twist = twist(0.5, 0.0);
  for (const double speed : {0.0, 1.4}) {
    run.chaser_twist = twist(speed, 0.0);
    TrackingData data = run.data({{.name = "camera", .type = SensorType::bearing}}, every(1.0, 0.0, 40.0));
    for (std::size_t i = 0; i < data.sensors[0].measurements.size(); ++i)  // noise of one standard deviation
      data.sensors[0].measurements[i].azimuth += i % 3 == 0 ? 0.02 : -0.01;
    const TrackingProblem tracking = make_tracking_problem(data);
    for (const PlacedMeasurement& placed : tracking.measurements) {
      const Measurement& m = data.sensors[0].measurements[placed.index];
      const Vector<3> position = tracking.target_state(placed.keyframe).position;
      const Vector<3> seen = tracking.chaser_pose(placed.keyframe).inverse().act(position);
      EXPECT_GE(seen.norm(), 0.02) << speed << " m/s, at " << m.t;
      EXPECT_GE(Direction<3>(m.azimuth, m.elevation).unit().dot(seen.normalized()), 0.7) << speed << " m/s, at " << m.t;
    }
  }
}

TEST_P(InitialGuess, SolverImprovesGuessFromRanges) {
  const TrackingData data = run.data({{.name = "modem", .type = SensorType::range}}, every(1.0, 0.0, 40.0));
  TrackingProblem tracking = make_tracking_problem(data);
  const double before = cost(tracking);
  ASSERT_TRUE(std::isfinite(before));
  const Summary summary = solve(tracking.problem, GaussNewtonOptions{});
  EXPECT_LT(summary.cost, 1e-2 * before) << summary.message;
}

TEST_P(InitialGuess, FollowsPositionsAndHeadsInDirectionOfTravel) {
  const TrackingData data = run.data({{.name = "usbl", .type = SensorType::range_bearing}}, every(2.0, 0.0, 40.0));
  const TrackingProblem tracking = make_tracking_problem(data);
  EXPECT_LE(run.largest_error(tracking), 1.0);
  EXPECT_LE(run.largest_angle(tracking), 0.4);
}

TEST_P(InitialGuess, AccountsForLeverArms) {
  TargetSensor usbl{.name = "usbl", .type = SensorType::position};
  usbl.mount = run.flat(Simulation::pose(0.5, 2.0, -0.4, 1.1));
  usbl.marker = run.flat(Simulation::pose(-6.0, 1.0, 0.5, 0.0));
  const auto error = [&](double yaw_rate) {
    run.target_twist = twist(0.9, yaw_rate);
    return run.largest_error(make_tracking_problem(run.data({usbl}, every(1.0, 0.0, 40.0))));
  };
  EXPECT_LE(error(0.0), 1e-3) << "m, with a beacon 6 m astern";
  EXPECT_LE(error(0.06), 3.0) << "in a turn, the beacon does not move in the direction of the heading";
}

/// Poses at 2 Hz, some of them turned by 180°.
class TurnedDetections : public InitialGuess {
 protected:
  TrackingData data = run.data({{.name = "camera", .type = SensorType::pose}}, every(0.5, 0.0, 40.0));

  void turn(std::size_t i) {
    SO3& R = data.sensors[0].measurements[i].rotation;
    R = R * SO3::Exp({0.0, 0.0, M_PI});
  }
  /// Returns the largest orientation error of the initial guess [rad].
  double worst(bool robust) const {
    const auto keyframes = make_keyframes(data);
    const TargetGuess guess =
        initial_target_guess(data, keyframes, odometry_at(data.odometry, keyframes), {.robust_initial_guess = robust});
    double largest = 0;
    for (std::size_t k = 0; k < keyframes.size(); ++k) {
      const SO3 truth = run.target(keyframes[k].t).rotation();
      largest = std::max(largest, (truth.inverse() * guess.pose[k].rotation()).Log().norm());
    }
    return largest;
  }
};

TEST_P(TurnedDetections, AreIgnored) {
  EXPECT_LE(worst(true), 1e-9) << "without turned detections, all are used";
  for (const std::size_t i : {0u, 7u, 8u, 20u, 33u, 34u, 35u, 60u, 80u}) turn(i);
  EXPECT_GT(worst(false), 3.0);
  EXPECT_LE(worst(true), 0.1);
}

TEST_P(TurnedDetections, DirectionOfTravelResolvesTies) {
  for (std::size_t i = 0; i < data.sensors[0].measurements.size(); i += 2) turn(i);
  EXPECT_LE(worst(true), 0.1);
}

TEST_P(TurnedDetections, TargetMovingAsternKeepsMeasuredOrientation) {
  run.target_twist = twist(-0.5, 0.0);
  data = run.data({{.name = "camera", .type = SensorType::pose}}, every(0.5, 0.0, 40.0));
  EXPECT_LE(worst(true), 1e-9);
}

TEST_P(TurnedDetections, RobustEstimateRejectsThem) {
  for (const std::size_t i : {3u, 7u, 8u, 20u, 33u, 34u, 35u, 60u}) turn(i);
  TrackingOptions options;
  make_robust(options);
  TrackingProblem tracking = make_tracking_problem(data, options);
  EXPECT_TRUE(converges(tracking));
  EXPECT_LE(run.largest_angle(tracking), 0.02);
  EXPECT_LE(run.largest_error(tracking), 0.05);
  int rejected = 0;
  for (const PlacedMeasurement& placed : tracking.measurements)
    rejected += tracking.problem.weight(*placed.block) < 0.5;
  EXPECT_EQ(rejected, 8);
}

INSTANTIATE_TEST_SUITE_P(Groups, InitialGuess, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "SE2" : "SE3"; });
INSTANTIATE_TEST_SUITE_P(Groups, TurnedDetections, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "SE2" : "SE3"; });

}  // namespace
}  // namespace tandem::testing
