#include <cmath>
#include <functional>
#include <map>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/tracking/ego_track.hpp>
#include <tandem/solvers/gauss_newton.hpp>

#include "online_cases.hpp"

/// Online estimation of a chaser with its own sensors, alone and with a target, compared with the batch problems.
namespace tandem {
namespace {

using testing::exactly, testing::LevelTurn, testing::noisy, testing::text_of, testing::vessel;
using ::testing::HasSubstr;
using MaybeRejection = std::optional<Rejection>;

TEST(OnlineEgo, AWindowLongerThanTheRunGivesTheBatchEstimate) {
  const LevelTurn turn;
  const NavigationData data = noisy(turn);
  OnlineEstimator estimator(TrackingData(), data, exactly(turn));
  replay(data, HUGE_VAL, estimator);
  const auto window = estimator.window();
  ASSERT_EQ(window.size(), 21u);
  NavigationProblem batch = make_navigation_problem(data, window, turn.start());
  ASSERT_TRUE(solve(batch.problem, GaussNewtonOptions{}).converged());
  for (std::size_t k = 0; k < window.size(); ++k) {
    const EgoState &a = window[k].value, b = batch.state(k);
    EXPECT_LE((a.pose.inverse() * b.pose).Log().norm(), 2e-4) << k;
    EXPECT_LE((a.velocity - b.velocity).norm(), 2e-4) << k;
  }
  EXPECT_GE(turn.largest_error(batch), 5e-3) << "the noise has an effect";
}

/// Correlated biases of DVL and depth, scale and misalignment of the DVL; with a long and a short window.
TEST(OnlineEgo, SystematicErrorsAgreeWithTheBatchEstimate) {
  const LevelTurn turn;
  NavigationData data = noisy(turn);
  for (EgoSensor& sensor : data.sensors)
    if (sensor.name == "dvl" || sensor.name == "depth") {
      SystematicError& error = sensor.error.emplace();
      error.bias_sigma = 3 * sensor.sigma;
      error.correlation_time = 20;
      if (sensor.name == "dvl") error.scale_sigma = error.misalignment_sigma = 0.05;
    }
  OnlineEstimator whole(TrackingData(), data, exactly(turn)), brief(TrackingData(), data, exactly(turn, 3));
  std::size_t most = 0;
  brief.on_update = [&](const OnlineUpdate& u) {
    EXPECT_NE(u.summary.status, Status::failed);
    most = std::max(most, brief.keyframes());
  };
  replay(data, HUGE_VAL, whole);
  replay(data, HUGE_VAL, brief);
  NavigationProblem batch = make_navigation_problem(data, whole.window(), turn.start());
  EXPECT_TRUE(solve(batch.problem, GaussNewtonOptions{}).converged());
  EXPECT_LE(most, 5u);
  const SE3 at_end = batch.state(batch.keyframes.size() - 1).pose;
  EXPECT_LE((at_end.inverse() * whole.chaser().pose).Log().norm(), 1e-3);  // preintegrated with different biases
  const Vector<6> apart = (at_end.inverse() * brief.chaser().pose).Log();  // linearised when states left the window
  const Vector<6> sigma = whole.covariance().chaser.diagonal().cwiseSqrt();
  EXPECT_LE((apart.array() / sigma.array()).abs().maxCoeff(), 0.15) << (apart.array() / sigma.array()).transpose();
}

/// The motion around a fix comes from the samples until then.
TEST(OnlineEgo, EstimatesADelayAndAnUnbiasedPosition) {
  LevelTurn turn;
  turn.duration = 60;
  NavigationData data = noisy(turn);
  const auto gps = std::find_if(data.sensors.begin(), data.sensors.end(),
                                [](const EgoSensor& s) { return s.type == EgoSensorType::gps; });
  ASSERT_NE(gps, data.sensors.end());
  gps->sigma.setConstant(0.02);
  for (EgoMeasurement& m : gps->measurements) m.value = turn.measure(*gps, m.t - 0.2).value;
  const auto error_at_the_end = [&](const OnlineEstimator& estimator) {
    return (LevelTurn::pose(estimator.newest()).inverse() * estimator.chaser().pose).translation().norm();
  };
  OnlineOptions options = exactly(turn, 8);
  options.reset.gate = HUGE_VAL;
  OnlineEstimator without_delay(TrackingData(), data, options);
  replay(data, HUGE_VAL, without_delay);
  gps->error = SystematicError{.delay_sigma = 0.3};
  OnlineEstimator estimator(TrackingData(), data, options);
  replay(data, HUGE_VAL, estimator);
  const auto found = estimator.sensor_errors();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].name, "gps.delay");
  EXPECT_NEAR(found[0].value[0], 0.2, 0.02);
  EXPECT_LE(error_at_the_end(estimator), 0.05);
  EXPECT_GE(error_at_the_end(without_delay), 0.15);
}

TEST(OnlineEgo, ContinuesWithoutTheImu) {
  LevelTurn turn;
  turn.duration = 30;
  NavigationData data = turn.data();
  std::erase_if(data.imu->samples, [](const ImuSample& s) { return s.t > 14.7; });
  OnlineEstimator estimator(TrackingData(), data, exactly(turn, 10));
  replay(data, HUGE_VAL, estimator);
  EXPECT_GE(estimator.newest(), 29.0);
  EXPECT_FALSE(estimator.splits().empty());
  const SE3 off = LevelTurn::pose(estimator.newest()).inverse() * estimator.chaser().pose;
  EXPECT_LE(off.translation().norm(), 0.5);
  EXPECT_LE(off.rotation().Log().norm(), 0.1);
}

/// Feeds the data in the order of arrival. `arrival` [s]: of an IMU sample, by its time; others arrive at once.
void replay_late(const NavigationData& data, const std::function<double(double)>& arrival, OnlineEstimator& estimator) {
  std::multimap<double, std::function<MaybeRejection()>> lines;
  for (const ImuSample& sample : data.imu->samples)
    lines.emplace(arrival(sample.t), [&] { return estimator.add_imu(sample); });
  for (std::size_t i = 0; i < data.sensors.size(); ++i)
    for (const EgoMeasurement& m : data.sensors[i].measurements)
      lines.emplace(m.t, [&estimator, i, &m] { return estimator.add_ego(i, m); });
  for (const auto& [t, add] : lines) {
    const MaybeRejection why = add();
    EXPECT_FALSE(why) << text_of(why);
  }
  estimator.finish();
}

/// Such as over a serial link or a network. The chaser must not coast between samples that are on their way.
TEST(OnlineEgo, AwaitsAnImuThatArrivesLateOrInPackets) {
  const LevelTurn turn{.duration = 30};
  const NavigationData data = noisy(turn);
  const auto run = [&](const std::function<double(double)>& arrival) {
    OnlineEstimator estimator(TrackingData(), data, exactly(60));
    std::size_t updates = 0;
    estimator.on_update = [&](const OnlineUpdate&) { ++updates; };
    replay_late(data, arrival, estimator);
    EXPECT_TRUE(estimator.splits().empty());
    return std::pair(updates, estimator.chaser().pose);
  };
  const auto [updates, pose] = run([](double t) { return t; });
  for (const double delay : {0.05, 0.9, 2.0})
    for (const double packet : {0.0, 1.0, 3.0}) {
      SCOPED_TRACE(::testing::Message() << delay << " s late, in packets of " << packet << " s");
      const auto [late_updates, late_pose] =
          run([&](double t) { return delay + (packet > 0 ? packet * std::ceil(t / packet) : t); });
      EXPECT_NEAR(double(late_updates), double(updates), 2);
      EXPECT_LE((pose.inverse() * late_pose).Log().norm(), 0.01);
    }
}

TEST(OnlineEgo, RejectsLateAndDecreasingTimes) {
  const LevelTurn turn;
  const NavigationData data = turn.data();
  OnlineEstimator estimator(TrackingData(), data, exactly(turn, 5));
  replay(data, HUGE_VAL, estimator);
  EXPECT_THAT(text_of(estimator.add_imu(data.imu->samples[100])),
              HasSubstr("imu: the sample at 2.000000 s is not later than the previous one"));
  EXPECT_THAT(text_of(estimator.add_ego(0, data.sensors[0].measurements[3])),
              HasSubstr("is older than the window, which begins at"));
  EXPECT_THAT(text_of(estimator.add_odometry({21, SE3()})), HasSubstr("moves by its own sensors"));
}

TEST(OnlineEgo, DepthAndHeadingAloneDoNotAidAChaser) {
  const LevelTurn turn;
  NavigationData data = turn.data();
  for (EgoSensor& sensor : data.sensors)
    if (sensor.type == EgoSensorType::dvl || sensor.type == EgoSensorType::gps)
      std::erase_if(sensor.measurements, [](const EgoMeasurement& m) { return m.t > 10; });
  OnlineOptions options = exactly(turn);
  options.reset.lost_after = 5;
  OnlineEstimator estimator(TrackingData(), data, options);
  replay(data, 14, estimator);
  EXPECT_EQ(estimator.health().chaser.state, OutputState::aided);
  OnlineEstimator longer(TrackingData(), data, options);
  replay(data, HUGE_VAL, longer);
  EXPECT_EQ(longer.health().chaser.state, OutputState::lost);
  EXPECT_NEAR(longer.health().chaser.age, 10, 0.5);
  EXPECT_EQ(longer.health().target.state, OutputState::none);
}

/// An estimator that replaces another one keeps the information about the biases.
TEST(OnlineEgo, TheHandoverStartHasTheBiasesAndTheirSigmas) {
  LevelTurn turn;
  turn.duration = 40;
  turn.bias << 0.05, -0.03, 0.02, 0.004, -0.003, 0.002;
  const NavigationData data = turn.data();
  OnlineEstimator first(TrackingData(), data, exactly(turn, 10));
  replay(data, 30, first);
  OnlineOptions options = exactly(10);
  options.start = first.handover_start();
  ASSERT_TRUE(options.start && options.start->sigmas.bias);
  const Matrix<6, 6> known = first.covariance().bias;
  EXPECT_TRUE(options.start->sigmas.bias->isApprox(Vector<6>(known.diagonal().cwiseSqrt()), 1e-9));

  NavigationData rest = data;
  const double t = options.start->t;
  std::erase_if(rest.imu->samples, [&](const ImuSample& s) { return s.t < t - 0.05; });
  for (EgoSensor& sensor : rest.sensors)
    std::erase_if(sensor.measurements, [&](const EgoMeasurement& m) { return m.t <= t; });
  const auto bias_error = [&](const OnlineOptions& from) {
    OnlineEstimator estimator(TrackingData(), rest, from);
    replay(rest, t + 1.2, estimator);
    EXPECT_GE(estimator.newest(), t + 1);
    return (estimator.chaser().bias - turn.bias).norm();
  };
  const double carried = bias_error(options);
  options.start->sigmas.bias.reset();
  EXPECT_LT(5 * carried, bias_error(options)) << "with the specification of the IMU only";
}

/// A measurement within the window has the same effect late as in time.
TEST(OnlineEgo, UsesALateMeasurement) {
  const LevelTurn turn;
  const NavigationData data = noisy(turn);
  NavigationData all_but_one = data;
  auto& gps = all_but_one.sensors[2].measurements;
  const EgoMeasurement late = gps[4];
  gps.erase(gps.begin() + 4);
  OnlineEstimator in_time(TrackingData(), data, exactly(turn)), with_late(TrackingData(), all_but_one, exactly(turn));
  replay(data, HUGE_VAL, in_time);
  replay(all_but_one, HUGE_VAL, with_late);
  const auto off = [&] { return (in_time.chaser().pose.translation() - with_late.chaser().pose.translation()).norm(); };
  const double before = off();
  EXPECT_FALSE(with_late.add_ego(2, late));
  with_late.finish();
  EXPECT_LE(off(), 1e-5);
  EXPECT_GT(before, 10 * off());
}

/// Without a heading sensor, GPS determines the heading when the vehicle moves.
TEST(OnlineEgo, AlignsTheHeadingByGps) {
  LevelTurn turn;
  turn.duration = 40;
  NavigationData data = turn.data();
  std::erase_if(data.sensors, [](const EgoSensor& s) { return s.type == EgoSensorType::heading; });
  ASSERT_TRUE(coarse_alignment(data).heading_unknown);
  const Alignment found = align(data, 30, OnlineOptions());
  OnlineOptions options;
  options.start = found;
  OnlineEstimator estimator(TrackingData(), data, options);
  replay(data, HUGE_VAL, estimator);
  const SE3 truth = LevelTurn::pose(estimator.newest());
  EXPECT_LE((truth.rotation().inverse() * estimator.chaser().pose.rotation()).Log().norm(), 0.1);
}

TrackingData fixes(const LevelTurn& turn) {
  TrackingData d;
  d.noise.constant_twist = Vector<6>(0.02, 0.02, 0.02, 0.005, 0.005, 0.005);
  TargetSensor usbl{.name = "usbl", .type = SensorType::position, .sigma = Vector<3>::Constant(0.2)};
  for (int i = 0; i <= int(turn.duration); i += 2)
    usbl.measurements.push_back({.t = double(i),
                                 .position = LevelTurn::pose(i).inverse().act(vessel(i).translation()) +
                                             0.2 * Vector<3>(std::sin(3. * i), std::cos(5. * i), std::sin(1. + i))});
  d.sensors = {usbl};
  return d;
}

TEST(OnlineEgo, GivesTheJointBatchEstimateWithATarget) {
  const LevelTurn turn;
  const NavigationData data = noisy(turn);
  TrackingData tracking = fixes(turn);
  OnlineEstimator estimator(tracking, data, exactly(turn));
  auto fix = tracking.sensors[0].measurements.begin();
  const auto fixes_to = [&](double t) {
    for (; fix != tracking.sensors[0].measurements.end() && fix->t <= t; ++fix) {
      const auto rejection = estimator.add_target(0, *fix);
      EXPECT_FALSE(rejection) << rejection->text;
    }
  };
  auto sample = data.imu->samples.begin();
  for (const EgoEvent& event : in_time_order(data.sensors)) {
    for (; sample != data.imu->samples.end() && sample->t <= event.t; ++sample) {
      fixes_to(sample->t);
      estimator.add_imu(*sample);
    }
    estimator.add_ego(event.sensor, data.sensors[event.sensor].measurements[event.index]);
  }
  for (; sample != data.imu->samples.end(); ++sample) {
    fixes_to(sample->t);
    estimator.add_imu(*sample);
  }
  estimator.finish();
  ASSERT_TRUE(estimator.has_target());
  ASSERT_NEAR(estimator.newest(), 20, 1e-9);

  const auto window = estimator.window();
  for (const auto& [t, state] : window) tracking.odometry.push_back({t, state.pose});
  tracking.ego = std::make_shared<const EgoTrack>(EgoTrack{data, turn.start(), window, {}});
  TrackingProblem batch = make_tracking_problem(tracking);
  ASSERT_TRUE(solve(batch.problem, GaussNewtonOptions{}).converged());
  ASSERT_EQ(batch.keyframes.size(), window.size());
  const std::size_t last = window.size() - 1;
  EXPECT_LE((batch.chaser_pose(last).inverse() * estimator.chaser().pose).Log().norm(), 1e-3);
  EXPECT_LE((batch.target_state(last).position - estimator.target()->position).norm(), 1e-3);
  EXPECT_LE((batch.target_state(last).position - vessel(20).translation()).norm(), 0.5);
  const RelativeTarget now = estimator.relative_target(0).value(), ahead = estimator.relative_target(2).value();
  const Vector<3> e = ahead.position - LevelTurn::pose(20).inverse().act(vessel(22).translation());
  EXPECT_LE(e.dot(ahead.covariance.value().inverse() * e), 14.2) << "0.3 % level of χ² with three degrees of freedom";
  EXPECT_GT(ahead.covariance->trace(), now.covariance.value().trace());
}

}  // namespace
}  // namespace tandem
