#include <gtest/gtest.h>

#include <tandem/solvers/online/online_estimator.hpp>

#include "problem/tracking/simulated_run.hpp"
#include "target_lines.hpp"

namespace tandem::testing {
namespace {

struct ConstraintsCase {
  MotionModel model;
  Mode mode;
  bool planar, hypotheses;
};

class OnlineConstraints : public ::testing::TestWithParam<ConstraintsCase> {};

/// The target moves at 0.9 m/s and turns. The estimate respects a hard limit of 0.6 m/s, although all fixes contradict it.
TEST_P(OnlineConstraints, AreHard) {
  const ConstraintsCase& c = GetParam();
  const SimulatedRun run{.planar = c.planar, .duration = 30, .target_twist = twist(0.9, 0.06)};
  TrackingData data = run.data({{.name = "sonar", .type = SensorType::position}}, every(0.8, 0.0, run.duration));
  data.sensors.push_back(run.data({{.name = "camera", .type = SensorType::pose}}, every(1.6, 3.2, 20.0)).sensors[0]);
  data.noise.twist_time.setConstant(50);
  data.noise.velocity_time.setConstant(50);
  OnlineOptions options;
  options.lag.window = 10;
  options.lag.max_iterations = 12;
  options.reset = ResetOptions::never();
  options.hypotheses = c.hypotheses;
  options.tracking = {.model = c.model,
                      .mode = c.mode,
                      .roll_pitch = Role::hard,
                      .non_holonomic = Role::hard,
                      .surge = Bounds<1>{Vector<1>(0.0), Vector<1>(0.6)},
                      .max_yaw_rate = 0.1,
                      .limits = Role::hard};
  OnlineEstimator estimator(data, {}, options);
  int updates = 0, converged = 0;
  double largest = 0;
  estimator.on_update = [&](const OnlineUpdate& update) {
    ++updates;
    converged += update.summary.converged();
    EXPECT_NE(update.summary.status, Status::infeasible) << update.summary.message;
    if (update.summary.converged()) EXPECT_LE(update.summary.max_violation, 1e-8) << update.summary.worst_constraint;
    if (update.t < 8 || update.t > 20) return;
    if (c.mode == Mode::A) largest = std::max(largest, estimator.target_velocity().value().norm());
    EXPECT_TRUE(estimator.relative_target(5).has_value());
  };
  for (const Line& line : lines(data)) {
    if (line.sensor < 0)
      estimator.add_odometry(data.odometry[line.index]);
    else
      estimator.add_target(std::size_t(line.sensor), data.sensors[std::size_t(line.sensor)].measurements[line.index]);
  }
  estimator.finish();
  EXPECT_GT(updates, 30);
  EXPECT_GE(converged, updates - 3);
  EXPECT_LE(largest, 0.6 + 1e-6);
}

INSTANTIATE_TEST_SUITE_P(
    All, OnlineConstraints,
    ::testing::Values(ConstraintsCase{MotionModel::constant_twist, Mode::A, false, false},
                      ConstraintsCase{MotionModel::constant_twist, Mode::A, true, false},
                      ConstraintsCase{MotionModel::constant_twist, Mode::B, false, false},
                      ConstraintsCase{MotionModel::constant_twist, Mode::B, false, true},
                      ConstraintsCase{MotionModel::damped_twist, Mode::A, false, false},
                      ConstraintsCase{MotionModel::damped_twist, Mode::B, true, false},
                      ConstraintsCase{MotionModel::white_noise_acceleration, Mode::A, false, false},
                      ConstraintsCase{MotionModel::white_noise_acceleration, Mode::A, true, false}));

}  // namespace
}  // namespace tandem::testing
