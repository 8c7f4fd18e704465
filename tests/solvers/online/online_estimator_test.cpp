#include <algorithm>
#include <map>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/online/online_estimator.hpp>

#include "problem/tracking/simulated_run.hpp"
#include "target_lines.hpp"

/// Online estimation of a target from a chaser with odometry, compared with the batch problem.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;

TEST(OnlineTarget, AWindowLongerThanTheRunGivesTheBatchEstimate) {
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

TEST(OnlineTarget, GivesTheBatchEstimateInThePlane) {
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

TEST(OnlineTarget, ReturnsConsistentCovariances) {
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

/// A run with a pose and a range per second, of which one range is late.
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

TEST(OnlineTarget, UsesALateMeasurementAtAKeyframe) {
  Late run_with(7.0);
  OnlineEstimator estimator(run_with.data, {}, exactly_tracking({}));
  for (const Line& line : lines(run_with.data)) give(run_with.data, line, estimator);
  const Vector<3> before = estimator.target()->position;
  const auto rejection = estimator.add_target(1, run_with.late);
  EXPECT_FALSE(rejection) << rejection->text;
  estimator.finish();
  EXPECT_GT((estimator.target()->position - before).norm(), 1e-5);
  auto& ranges = run_with.data.sensors[1].measurements;
  ranges.insert(ranges.begin() + 7, run_with.late);
  expect_same(estimator, batch(run_with.data, {}));
}

TEST(OnlineTarget, UsesALateMeasurementBetweenKeyframes) {
  Late run_with(7.4);
  OnlineEstimator estimator(run_with.data, {}, exactly_tracking({}));
  for (const Line& line : lines(run_with.data)) give(run_with.data, line, estimator);
  const Vector<3> before = estimator.target()->position;
  const std::size_t keyframes = estimator.keyframes();
  const auto rejection = estimator.add_target(1, run_with.late);
  EXPECT_FALSE(rejection) << rejection->text;
  estimator.finish();
  EXPECT_EQ(estimator.keyframes(), keyframes);
  EXPECT_GT((estimator.target()->position - before).norm(), 1e-6);
  auto& ranges = run_with.data.sensors[1].measurements;
  ranges.insert(ranges.begin() + 8, run_with.late);
  const TrackingProblem all = batch(run_with.data, {});  // with one more keyframe
  EXPECT_LE((estimator.target()->position - all.target_state(all.keyframes.size() - 1).position).norm(), 0.02);
}

TEST(OnlineTarget, RejectsAMeasurementOlderThanTheWindow) {
  Late run_with(2.0);
  OnlineEstimator estimator(run_with.data, {}, exactly_tracking({}, 4.0));
  for (const Line& line : lines(run_with.data)) give(run_with.data, line, estimator);
  const double cost = estimator.cost();
  EXPECT_EQ(estimator.add_target(1, run_with.late)->kind, Rejection::Kind::too_late);
  EXPECT_THAT(text_of(estimator.add_target(1, run_with.late)),
              HasSubstr("ranger: the measurement valid at 2.000000 s is older than the window, which begins at "));
  EXPECT_EQ(estimator.cost(), cost);
}

TEST(OnlineTarget, TheOrderOfSimultaneousLinesHasNoEffect) {
  Simulation simulation;
  simulation.noise = 1.0;
  simulation.usbl_period = 1.85;  // some stamps coincide with odometry
  const TrackingData d = cropped(simulation.data());
  OnlineEstimator a(d, {}, exactly_tracking({}, 8.0)), b(d, {}, exactly_tracking({}, 8.0));
  run(d, a, true);
  run(d, b, false);
  EXPECT_EQ(a.newest(), b.newest());
  EXPECT_EQ(a.keyframes(), b.keyframes());
  EXPECT_LE((a.target()->position - b.target()->position).norm(), 1e-7);
}

TEST(OnlineTarget, TheWindowStaysBounded) {
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
  EXPECT_LE(most, 22u) << "one per second and one per fix";
  EXPECT_LE((estimator.target()->position - Simulation::target(estimator.newest()).translation()).norm(), 0.1);
}

TEST(OnlineTarget, HypothesesGiveTheNewestStateAndPredictions) {
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
  EXPECT_TRUE(estimator.target()->rotation.has_value()) << "from the course";
}

TEST(OnlineTarget, HypothesesNeedPositionFixes) {
  TrackingData d = Simulation().data();
  d.noise.constant_velocity.setConstant(0.1);
  EXPECT_EQ(why_hypotheses_unsupported(d, true), "");
  EXPECT_THAT(why_hypotheses_unsupported(d, false), HasSubstr("own sensors"));
  d.sensors[0].error.emplace().scale_sigma = 0.01;
  EXPECT_THAT(why_hypotheses_unsupported(d, true), HasSubstr("systematic errors"));
  d.sensors[0].error.reset();
  d.sensors[0].type = SensorType::bearing;
  EXPECT_THAT(why_hypotheses_unsupported(d, true), HasSubstr("does not measure a position"));
  OnlineOptions options;
  options.hypotheses = true;
  EXPECT_THAT([&] { OnlineEstimator(d, {}, options); },
              ::testing::ThrowsMessage<Error>(HasSubstr("motion hypotheses are not supported")));
  d = Simulation().data();
  d.noise.constant_velocity.setZero();
  EXPECT_THAT(why_hypotheses_unsupported(d, true), HasSubstr("constant_velocity"));
}

TEST(OnlineTarget, ReportsTypesOfTheBatchKeyframes) {
  SimulatedRun simulation;
  TrackingData d = simulation.data(
      {{.name = "usbl", .type = SensorType::position}, {.name = "camera", .type = SensorType::bearing}}, {});
  for (const double t : {0.5, 1.0, 4.0}) d.sensors[0].measurements.push_back(simulation.measure(d.sensors[0], t));
  for (const double t : {2.0, 4.0, 5.0}) d.sensors[1].measurements.push_back(simulation.measure(d.sensors[1], t));
  OnlineEstimator estimator(d, {}, exactly_tracking({}));
  std::map<double, KeyframeType> types;
  estimator.on_update = [&](const OnlineUpdate& update) { types[update.t] = update.type; };
  run(d, estimator);
  EXPECT_EQ(types.at(2.0), KeyframeType::partial);
  EXPECT_EQ(types.at(4.0), KeyframeType::position) << "a position and a bearing";
  EXPECT_EQ(types.at(5.0), KeyframeType::partial);
  for (const Keyframe& keyframe : make_keyframes(d))
    if (types.contains(keyframe.t)) {
      EXPECT_EQ(keyframe.type, types.at(keyframe.t)) << keyframe.t;
    }
}

TEST(OnlineTarget, RejectsDecreasingTimesAndUnknownSensors) {
  const TrackingData d = cropped(Simulation().data());
  OnlineEstimator estimator(d, {}, {});
  EXPECT_FALSE(estimator.add_odometry(d.odometry[1]));
  EXPECT_THAT(text_of(estimator.add_odometry(d.odometry[0])), HasSubstr("is not later than the previous one"));
  EXPECT_THAT(text_of(estimator.add_odometry(d.odometry[1])), HasSubstr("odometry"));
  EXPECT_THAT(text_of(estimator.add_imu({0, {}, {}})), HasSubstr("imu: not in use"));
  EXPECT_THAT(text_of(estimator.add_ego(0, {})), HasSubstr("the chaser has no sensor"));
  EXPECT_THAT(text_of(estimator.add_target(7, {})), HasSubstr("no sensor of the target"));
  EXPECT_EQ(estimator.add_odometry(d.odometry[1])->kind, Rejection::Kind::not_increasing);
  EXPECT_EQ(estimator.add_target(7, {})->kind, Rejection::Kind::not_in_use);
}

TEST(OnlineTarget, RejectsInvalidOptions) {
  const TrackingData d = Simulation().data();
  const auto rejection = [&](const TrackingOptions& tracking) -> std::string {
    OnlineOptions options;
    options.tracking = tracking;
    try {
      OnlineEstimator estimator(d, {}, options);
    } catch (const Error& error) {
      return error.what();
    }
    return "nothing";
  };
  EXPECT_THAT(rejection({.model = MotionModel::steady_course}), HasSubstr("steady-course model"));
  EXPECT_THAT(rejection({.model = MotionModel::white_noise_acceleration, .mode = Mode::B}),
              HasSubstr("mode B requires"));
  EXPECT_EQ(rejection({.max_yaw_rate = 0.1, .limits = Role::soft}), "nothing");
  EXPECT_THROW(OnlineEstimator(TrackingData(), {}, {}), Error);
  TrackingData late = d;
  late.sensors[0].error = SystematicError{.bias_sigma = Eigen::VectorXd::Constant(5, 1.0)};
  EXPECT_THAT([&] { OnlineEstimator(late, {}, {}); },
              ::testing::ThrowsMessage<Error>(HasSubstr("standard deviations, not 5")));
  TrackingData turned = d;
  OnlineOptions robust;
  robust.tracking.position_share = 0.5;
  for (TargetSensor& sensor : turned.sensors)
    if (sensor.type->has(measured::rotation)) sensor.error.emplace().misalignment_sigma = 0.02;
  EXPECT_THAT([&] { OnlineEstimator(turned, {}, robust); },
              ::testing::ThrowsMessage<Error>(HasSubstr("one residual for the whole pose")));
  TrackingData planar = d;
  planar.planar = true;
  EXPECT_THROW(OnlineEstimator(planar, NavigationData(), {}), Error);
}

}  // namespace
}  // namespace tandem::testing
