#include <algorithm>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/online/online_estimator.hpp>

#include "problem/tracking/simulated_run.hpp"
#include "target_lines.hpp"

/// A target by odometry and measurements that come in line by line, against the batch problem of all of them.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;

TEST(OnlineTarget, AWindowLongerThanTheRunIsTheBatchEstimate) {
  Simulation simulation;
  simulation.noise = 1.0;
  const TrackingData d = cropped(simulation.data());
  std::vector<std::pair<std::string, TrackingOptions>> cases(8);
  cases[0].first = "mode A";
  cases[1].first = "mode B, boundary";
  cases[1].second.mode = Mode::B;
  cases[2].first = "mode B, direct";
  cases[2].second.mode = Mode::B;
  cases[2].second.junction = Junction::direct;
  cases[3].first = "white noise on acceleration";
  cases[3].second.model = MotionModel::white_noise_acceleration;
  cases[4].first = "constant velocity";
  cases[4].second.model = MotionModel::constant_velocity;
  cases[5].first = "robust";
  cases[5].second.loss = Huber(2.0);
  cases[6].first = "damped twist, mode B";
  cases[6].second = {.model = MotionModel::damped_twist, .mode = Mode::B};
  cases[7].first = "damped velocity";
  cases[7].second.model = MotionModel::damped_velocity;
  TrackingData noisy = d;
  noisy.noise.constant_velocity.setConstant(0.1);
  for (const auto& [name, options] : cases) {
    SCOPED_TRACE(name);
    OnlineEstimator estimator(noisy, {}, exactly_tracking(options));
    run(noisy, estimator);
    expect_same(estimator, batch(noisy, options));
  }
}

TEST(OnlineTarget, InThePlane) {
  SimulatedRun simulation;
  simulation.planar = true;
  TrackingData d = simulation.data({{.name = "camera", .type = SensorType::pose}}, every(1.5, 0.5, 11.9));
  for (Measurement& m : d.sensors[0].measurements)
    m.position.head<2>() += 0.1 * Vector<2>(std::sin(m.t), std::cos(2 * m.t));
  d = cropped(d);
  OnlineEstimator estimator(d, {}, exactly_tracking({}));
  run(d, estimator);
  expect_same(estimator, batch(d, {}));
}

TEST(OnlineTarget, CovariancesAreThoseOfTheBatchEstimate) {
  Simulation simulation;
  const TrackingData d = cropped(simulation.data());
  OnlineEstimator estimator(d, {}, exactly_tracking({}));
  run(d, estimator);
  const auto c = estimator.covariance();
  ASSERT_EQ(c.joint.rows(), 12);
  EXPECT_EQ(c.velocity.size(), 0);
  EXPECT_LE((c.joint.topLeftCorner(6, 6) - c.chaser).norm(), 1e-12);
  EXPECT_LE((c.joint.bottomRightCorner(6, 6) - c.target).norm(), 1e-12);
  EXPECT_GT(c.target.trace(), 0);
}

/// Of the run with a range beside each position, all but one in time.
struct Late {
  TrackingData data;
  Measurement late;

  explicit Late(double t) {
    SimulatedRun simulation;
    data =
        simulation.data({{.name = "camera", .type = SensorType::pose}, {.name = "ranger", .type = SensorType::range}},
                        every(1.0, 0.0, 12.0));
    for (Measurement& m : data.sensors[0].measurements)
      m.position += 0.1 * Vector<3>(std::sin(m.t), std::cos(2 * m.t), 0);
    late = simulation.measure(data.sensors[1], t);
    late.range += 0.05;
    std::erase_if(data.sensors[1].measurements, [&](const Measurement& m) { return m.t == t; });
  }
};

TEST(OnlineTarget, ALateMeasurementAtAKeyframeCountsAsInTheBatch) {
  Late run_with(7.0);
  OnlineEstimator estimator(run_with.data, {}, exactly_tracking({}));
  for (const Line& line : lines(run_with.data)) give(run_with.data, line, estimator);
  const Vector<3> before = estimator.target()->position;
  const auto refused = estimator.add_target(1, run_with.late);
  EXPECT_FALSE(refused) << refused->text;
  estimator.finish();
  EXPECT_GT((estimator.target()->position - before).norm(), 1e-5);
  auto& ranges = run_with.data.sensors[1].measurements;
  ranges.insert(ranges.begin() + 7, run_with.late);
  expect_same(estimator, batch(run_with.data, {}));
}

TEST(OnlineTarget, ALateMeasurementBetweenKeyframes) {
  Late run_with(7.4);
  OnlineEstimator estimator(run_with.data, {}, exactly_tracking({}));
  for (const Line& line : lines(run_with.data)) give(run_with.data, line, estimator);
  const Vector<3> before = estimator.target()->position;
  const std::size_t keyframes = estimator.keyframes();
  const auto refused = estimator.add_target(1, run_with.late);
  EXPECT_FALSE(refused) << refused->text;
  estimator.finish();
  EXPECT_EQ(estimator.keyframes(), keyframes);
  EXPECT_GT((estimator.target()->position - before).norm(), 1e-6);
  auto& ranges = run_with.data.sensors[1].measurements;
  ranges.insert(ranges.begin() + 8, run_with.late);
  const TrackingProblem all = batch(run_with.data, {});  // with a keyframe more, whose motion is as free
  EXPECT_LE((estimator.target()->position - all.target_state(all.keyframes.size() - 1).position).norm(), 0.02);
}

TEST(OnlineTarget, OneOlderThanTheWindowIsRefused) {
  Late run_with(2.0);
  OnlineEstimator estimator(run_with.data, {}, exactly_tracking({}, 4.0));
  for (const Line& line : lines(run_with.data)) give(run_with.data, line, estimator);
  const double cost = estimator.cost();
  EXPECT_EQ(estimator.add_target(1, run_with.late)->kind, Refusal::Kind::too_late);
  EXPECT_THAT(text_of(estimator.add_target(1, run_with.late)),
              HasSubstr("ranger: the measurement valid at 2.000000 s is older than the window, which begins at "));
  EXPECT_EQ(estimator.cost(), cost);
}

TEST(OnlineTarget, WithinTheWindowTheOrderOfOneInstantsLinesDoesNotMatter) {
  Simulation simulation;
  simulation.noise = 1.0;
  simulation.usbl_period = 1.85;  // some at the same stamps as odometry
  const TrackingData d = cropped(simulation.data());
  OnlineEstimator a(d, {}, exactly_tracking({}, 8.0)), b(d, {}, exactly_tracking({}, 8.0));
  run(d, a, true);
  run(d, b, false);
  EXPECT_EQ(a.newest(), b.newest());
  EXPECT_EQ(a.keyframes(), b.keyframes());
  EXPECT_LE((a.target()->position - b.target()->position).norm(), 1e-7);
}

TEST(OnlineTarget, TheWindowStaysAsLargeAsItIs) {
  Simulation simulation;
  simulation.duration = 150;
  simulation.optical = false;
  const TrackingData d = cropped(simulation.data());
  OnlineOptions options;
  options.lag.window = 10;
  OnlineEstimator estimator(d, {}, options);
  std::size_t updates = 0, most = 0;
  estimator.on_update = [&](const OnlineUpdate& u) {
    EXPECT_NE(u.summary.status, Status::failed);
    ++updates;
    most = std::max(most, estimator.keyframes());
    EXPECT_GE(estimator.oldest(), estimator.newest() - 10 - 1e-9);
    EXPECT_EQ(estimator.window().size(), estimator.keyframes());
  };
  run(d, estimator);
  EXPECT_GE(updates, 149u);
  EXPECT_LE(most, 22u) << "one a second and one a fix";
  EXPECT_LE((estimator.target()->position - Simulation::target(estimator.newest()).translation()).norm(), 0.1);
}

TEST(OnlineTarget, HypothesesTellTheNewestStateAndWhatComes) {
  Simulation simulation;
  simulation.noise = 1.0;
  TrackingData d = cropped(simulation.data());
  d.noise.constant_velocity.setConstant(0.1);
  OnlineOptions options;
  options.tracking.mode = Mode::B;
  options.hypotheses = true;
  OnlineEstimator estimator(d, {}, options);
  run(d, estimator);
  const double t = estimator.newest();
  const SE3 chaser = estimator.chaser().pose;
  for (const double h : {0.0, 3.0}) {
    const RelativeTarget there = estimator.relative_target(h).value();
    const Vector<3> e = there.position - chaser.inverse().act(Simulation::target(t + h).translation());
    EXPECT_LE(e.dot(there.covariance.value().inverse() * e), 25) << h;
    EXPECT_LE((chaser.inverse().act(estimator.predicted_target(h)->position) - there.position).norm(), 1e-9) << h;
  }
  EXPECT_GT(estimator.relative_target(3)->covariance->trace(), estimator.relative_target(0)->covariance->trace());
  EXPECT_TRUE(estimator.target()->rotation.has_value()) << "the course tells it";
}

TEST(OnlineTarget, HypothesesNeedFixesOfPositions) {
  TrackingData d = Simulation().data();
  d.noise.constant_velocity.setConstant(0.1);
  EXPECT_EQ(why_no_hypotheses(d, true), "");
  EXPECT_THAT(why_no_hypotheses(d, false), HasSubstr("own sensors"));
  d.sensors[0].error.emplace().scale = 0.01;
  EXPECT_THAT(why_no_hypotheses(d, true), HasSubstr("an error that stays"));
  d.sensors[0].error.reset();
  d.sensors[0].type = SensorType::bearing;
  EXPECT_THAT(why_no_hypotheses(d, true), HasSubstr("does not give a position"));
  OnlineOptions options;
  options.hypotheses = true;
  EXPECT_THAT([&] { OnlineEstimator(d, {}, options); },
              ::testing::ThrowsMessage<Error>(HasSubstr("motion hypotheses cannot serve here")));
  d = Simulation().data();
  d.noise.constant_velocity.setZero();
  EXPECT_THAT(why_no_hypotheses(d, true), HasSubstr("constant_velocity"));
}

TEST(OnlineTarget, TimesThatRunBackwardsAreRefused) {
  const TrackingData d = cropped(Simulation().data());
  OnlineEstimator estimator(d, {}, {});
  EXPECT_FALSE(estimator.add_odometry(d.odometry[1]));
  EXPECT_THAT(text_of(estimator.add_odometry(d.odometry[0])), HasSubstr("is not later than the one before"));
  EXPECT_THAT(text_of(estimator.add_odometry(d.odometry[1])), HasSubstr("is not later than the one before"));
  EXPECT_THAT(text_of(estimator.add_imu({0, {}, {}})), HasSubstr("there is no such sensor here"));
  EXPECT_THAT(text_of(estimator.add_ego(0, {})), HasSubstr("there is no such sensor of the chaser here"));
  EXPECT_THAT(text_of(estimator.add_target(7, {})), HasSubstr("there is no such sensor of a target here"));
  EXPECT_EQ(estimator.add_odometry(d.odometry[1])->kind, Refusal::Kind::backwards);
  EXPECT_EQ(estimator.add_target(7, {})->kind, Refusal::Kind::not_in_use);
}

TEST(OnlineTarget, OptionsThatCannotWork) {
  const TrackingData d = Simulation().data();
  const auto refusal = [&](const TrackingOptions& tracking) -> std::string {
    OnlineOptions options;
    options.tracking = tracking;
    try {
      OnlineEstimator estimator(d, {}, options);
    } catch (const Error& error) {
      return error.what();
    }
    return "nothing";
  };
  EXPECT_THAT(refusal({.model = MotionModel::steady_course}), HasSubstr("no window to estimate in"));
  EXPECT_THAT(refusal({.model = MotionModel::white_noise_acceleration, .mode = Mode::B}),
              HasSubstr("mode B is for the"));
  EXPECT_THAT(refusal({.roll_pitch = Role::hard}), HasSubstr("takes soft constraints only"));
  EXPECT_THAT(refusal({.non_holonomic = Role::hard}), HasSubstr("takes soft constraints only"));
  EXPECT_THAT(refusal({.max_yaw_rate = 0.1}), HasSubstr("takes soft constraints only"));
  EXPECT_EQ(refusal({.max_yaw_rate = 0.1, .limits = Role::soft}), "nothing");
  EXPECT_THROW(OnlineEstimator(TrackingData(), {}, {}), Error);
  TrackingData late = d;
  late.sensors[0].error = StayingError{.sigma = Eigen::VectorXd::Constant(5, 1.0)};
  EXPECT_THAT([&] { OnlineEstimator(late, {}, {}); },
              ::testing::ThrowsMessage<Error>(HasSubstr("standard deviations, not 5")));
  TrackingData turned = d;
  OnlineOptions robust;
  robust.tracking.position_share = 0.5;
  for (TargetSensor& sensor : turned.sensors)
    if (sensor.type->has(measured::rotation)) sensor.error.emplace().misalignment = 0.02;
  EXPECT_THAT([&] { OnlineEstimator(turned, {}, robust); },
              ::testing::ThrowsMessage<Error>(HasSubstr("nor a share of the position")));
  TrackingData planar = d;
  planar.planar = true;
  EXPECT_THROW(OnlineEstimator(planar, NavigationData(), {}), Error);
}

}  // namespace
}  // namespace tandem::testing
