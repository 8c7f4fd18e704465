#include <algorithm>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/solvers/online/online_estimator.hpp>

#include "problem/tracking/level_turn.hpp"
#include "problem/tracking/simulated_run.hpp"

/// Simultaneous measurements in any order of the streams, rejected measurements, and hooks that throw.
namespace tandem {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using testing::LevelTurn;
using ::testing::Optional;
using testing::SimulatedRun;
using testing::vessel;

/// A joint run with all measurements at whole seconds: IMU at 50 Hz; GPS, DVL and heading every second, position of the
/// target every 2 s, its pose every 3 s, all from 1 s on.
struct WholeSeconds {
  static constexpr int seconds = 8;
  LevelTurn turn{.duration = seconds};
  NavigationData ego;
  TrackingData target;

  WholeSeconds() {
    ego = turn.data();
    for (EgoSensor& sensor : ego.sensors) {
      sensor.measurements.clear();
      if (sensor.type == EgoSensorType::depth) continue;
      for (int t = 1; t <= seconds; ++t) {
        sensor.measurements.push_back(turn.measure(sensor, t));
        sensor.measurements.back().value += 0.3 * sensor.sigma[0] * Vector<3>(std::sin(5. * t), std::cos(3. * t), 1);
      }
    }
    target.noise.constant_twist = Vector<6>(0.02, 0.02, 0.02, 0.005, 0.005, 0.005);
    target.sensors = {{.name = "usbl", .type = SensorType::position, .sigma = Vector<3>::Constant(0.2)},
                      {.name = "camera", .type = SensorType::pose, .sigma = Vector<6>::Constant(0.05)}};
    for (int t = 1; t <= seconds; ++t) {
      const SE3 seen = LevelTurn::pose(t).inverse() * vessel(t);
      const Vector<3> error = 0.1 * Vector<3>(std::sin(3. * t), std::cos(5. * t), std::sin(1. + t));
      if (t % 2 == 0)
        target.sensors[0].measurements.push_back({.t = double(t), .position = seen.translation() + error});
      if (t % 3 == 0)
        target.sensors[1].measurements.push_back(
            {.t = double(t), .position = seen.translation() - 0.2 * error, .rotation = seen.rotation()});
    }
  }

  enum Stream { imu, own, usbl, camera };
  struct Result {
    std::size_t updates = 0, new_keyframes = 0;
    std::set<double> keyframes;
    std::vector<Stamped<EgoState>> window;
    std::optional<TargetState> target;
    double cost = 0;
  };

  Result run(const std::array<Stream, 4>& order) const {
    OnlineOptions options;
    options.start = turn.start();
    options.lag.window = 1e3;
    options.lag.max_iterations = 50;
    options.lag.cost_tolerance = 1e-13;
    OnlineEstimator estimator(target, ego, options);
    Result result;
    estimator.on_update = [&](const OnlineUpdate& u) {
      EXPECT_TRUE(u.summary.converged()) << u.summary.message;
      EXPECT_GE(u.seconds, 0);
      ++result.updates;
      if (!u.new_keyframe) return;
      ++result.new_keyframes;
      result.keyframes.insert(u.t);
    };
    const auto expect_accepted = [](const std::optional<Rejection>& why) { EXPECT_FALSE(why) << why->text; };
    for (std::size_t i = 0; i < ego.imu->samples.size(); ++i) {
      const ImuSample& sample = ego.imu->samples[i];
      for (const Stream stream : order) {
        if (stream == imu) expect_accepted(estimator.add_imu(sample));
        if (i % 50 != 0 || i == 0) continue;
        const std::size_t t = i / 50;
        if (stream == own)
          for (std::size_t s = 0; s < ego.sensors.size(); ++s)
            if (t <= ego.sensors[s].measurements.size())
              expect_accepted(estimator.add_ego(s, ego.sensors[s].measurements[t - 1]));
        if (stream == usbl && t % 2 == 0)
          expect_accepted(estimator.add_target(0, target.sensors[0].measurements[t / 2 - 1]));
        if (stream == camera && t % 3 == 0)
          expect_accepted(estimator.add_target(1, target.sensors[1].measurements[t / 3 - 1]));
      }
    }
    estimator.finish();
    result.window = estimator.window();
    result.target = estimator.target();
    result.cost = estimator.solve_to_convergence().cost;
    return result;
  }
};

TEST(OnlineOrder, OfSimultaneousMeasurementsHasNoEffect) {
  const WholeSeconds run;
  std::array<WholeSeconds::Stream, 4> order{WholeSeconds::own, WholeSeconds::usbl, WholeSeconds::camera,
                                            WholeSeconds::imu};
  const auto last = run.run(order);  // the IMU last
  EXPECT_EQ(last.updates, 8u) << "one per second";
  EXPECT_EQ(last.new_keyframes, 8u) << "in addition to the start";
  ASSERT_EQ(last.window.size(), 9u);
  std::sort(order.begin(), order.end());
  do {
    SCOPED_TRACE(::testing::PrintToString(order));
    const auto other = run.run(order);
    EXPECT_EQ(other.new_keyframes, 8u);
    EXPECT_EQ(other.keyframes, last.keyframes);
    EXPECT_GE(other.updates, last.updates);
    EXPECT_LE(other.updates, 8u + 4 + 2) << "one more for each measurement after the update of its time";
    ASSERT_EQ(other.window.size(), last.window.size());
    // Small differences remain, since the IMU was preintegrated with the bias of the previous update.
    for (std::size_t k = 0; k < last.window.size(); ++k) {
      const EgoState &a = other.window[k].value, &b = last.window[k].value;
      EXPECT_LE((a.pose.inverse() * b.pose).Log().norm(), 2e-5) << k;
      EXPECT_LE((a.velocity - b.velocity).norm(), 2e-5) << k;
    }
    EXPECT_LE((other.target->position - last.target->position).norm(), 2e-5);
    EXPECT_LE((other.target->rotation->inverse() * *last.target->rotation).Log().norm(), 2e-5);
    EXPECT_NEAR(other.cost, last.cost, 1e-5 * last.cost);
  } while (std::next_permutation(order.begin(), order.end()));
}

/// A chaser with odometry at 1 Hz, and a target observed by a camera and a range sensor.
struct ByOdometry {
  SimulatedRun simulation;
  TrackingData data =
      simulation.data({{.name = "camera", .type = SensorType::pose}, {.name = "ranger", .type = SensorType::range}},
                      testing::every(1.0, 0.0, 12.0));

  Stamped<SE3> odometry(double t) const { return {t, *pose_at(data.odometry, t)}; }
};

TEST(OnlineOrder, ARejectedMeasurementCausesNoUpdate) {
  const ByOdometry run;
  OnlineEstimator estimator(run.data, {}, {});
  int updates = 0;
  estimator.on_update = [&](const OnlineUpdate&) { ++updates; };
  EXPECT_FALSE(estimator.add_odometry(run.odometry(0)));
  EXPECT_FALSE(estimator.add_target(1, run.data.sensors[1].measurements[1]));
  EXPECT_THAT(estimator.add_odometry(run.odometry(1)),
              Optional(AllOf(
                  Field(&Rejection::kind, Rejection::Kind::unusable),
                  Field(&Rejection::text,
                        HasSubstr("ranger: cannot use the measurement valid at 1.000000 s; a position measurement")))))
      << "returned by the current call";
  EXPECT_FALSE(estimator.add_target(1, run.simulation.measure(run.data.sensors[1], 1.5)));
  std::vector<std::string> rejected;
  estimator.on_reject = [&](const std::string& sensor, const Rejection&) { rejected.push_back(sensor); };
  EXPECT_FALSE(estimator.add_odometry(run.odometry(2)));
  EXPECT_THAT(rejected, ElementsAre("ranger"));
  EXPECT_EQ(updates, 0);
  EXPECT_FALSE(estimator.add_target(0, run.data.sensors[0].measurements[2]));
  EXPECT_EQ(updates, 1);
  EXPECT_FALSE(estimator.add_target(1, run.data.sensors[1].measurements[2]));
  EXPECT_EQ(updates, 2);
  estimator.finish();
  EXPECT_EQ(updates, 2);
}

TEST(OnlineOrder, CallsTheMarginalizationHookOfTheCaller) {
  const ByOdometry run;
  OnlineOptions options;
  options.lag.window = 5;
  std::vector<double> left;
  options.lag.before_marginalize = [&](double t) { left.push_back(t); };
  OnlineEstimator estimator(run.data, {}, options);
  for (std::size_t t = 0; t <= 8; ++t) {
    estimator.add_target(0, run.data.sensors[0].measurements[t]);
    estimator.add_odometry(run.odometry(double(t)));
  }
  EXPECT_THAT(left, ElementsAre(0, 1, 2));
}

TEST(OnlineOrder, ResetWithinAHookTakesEffectAfterTheCall) {
  const LevelTurn turn;
  const NavigationData data = turn.data();
  OnlineOptions options;
  options.start = turn.start();
  options.lag.window = 5;
  for (const bool by_leaving : {true, false}) {
    OnlineEstimator estimator(TrackingData(), data, options);
    int resets = 0, errors = 0;
    const auto reset_once = [&] {
      if (resets++ > 0) return;
      const std::size_t keyframes = estimator.keyframes();
      estimator.reset();
      EXPECT_EQ(estimator.keyframes(), keyframes) << "not yet";
      try {
        estimator.finish();
      } catch (const BadInputError&) {
        ++errors;
      }
    };
    if (by_leaving)
      estimator.on_leave = [&](const Stamped<EgoState>&) { reset_once(); };
    else
      estimator.on_update = [&](const OnlineUpdate&) { reset_once(); };
    bool was_reset = false;
    for (const ImuSample& sample : data.imu->samples) {
      const int before = resets;
      estimator.add_imu(sample);
      if (before == 0 && resets > 0) {
        was_reset = !estimator.started();
        break;
      }
    }
    EXPECT_TRUE(was_reset);
    EXPECT_EQ(errors, 1);
  }
}

TEST(OnlineOrder, ContinuesAfterAHookThrows) {
  const LevelTurn turn;
  const NavigationData data = turn.data();
  OnlineOptions options;
  options.start = turn.start();
  options.lag.window = 5;
  std::vector<double> called, left;
  options.lag.before_marginalize = [&](double t) {
    called.push_back(t);
    if (called.size() == 2) throw Error("not now");
  };
  OnlineEstimator estimator(TrackingData(), data, options);
  estimator.on_leave = [&](const Stamped<EgoState>& state) { left.push_back(state.t); };
  int thrown = 0;
  for (const ImuSample& sample : data.imu->samples) {
    try {
      estimator.add_imu(sample);
    } catch (const Error& error) {
      EXPECT_STREQ(error.what(), "not now");
      ++thrown;
    }
    if (!estimator.started()) continue;
    EXPECT_EQ(estimator.window().size(), estimator.keyframes());
    EXPECT_GE(estimator.window().front().t, estimator.oldest() - kSameInstant) << "no state that is gone";
  }
  EXPECT_EQ(thrown, 1);
  EXPECT_EQ(estimator.keyframes(), 6u);
  ASSERT_GE(called.size(), 4u);
  EXPECT_EQ(called[1], called[2]);
  for (std::size_t i = 0; i < left.size(); ++i) EXPECT_NEAR(left[i], double(i), 1e-6);
}

}  // namespace
}  // namespace tandem
