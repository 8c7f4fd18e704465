#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/problem/tracking/tracking_initial_guess.hpp>

#include "simulated_tracking.hpp"

namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// Returns odometry at rest from `first` to `last` [s], and a position sensor with measurements at these times.
TrackingData measured_at(const std::vector<double>& times, double first = 0.0, double last = 5.0) {
  TrackingData data;
  data.noise.prior = data.noise.odometry = data.noise.constant_twist = Vector<6>::Constant(0.1);
  data.odometry = {{first, SE3()}, {last, SE3()}};
  TargetSensor sensor{.name = "usbl", .sigma = Vector<3>(0.1, 0.1, 0.1)};
  for (const double t : times) sensor.measurements.push_back({.t = t, .position = Vector<3>(t, 0.0, 0.0)});
  data.sensors.push_back(sensor);
  return data;
}

std::vector<double> times(const std::vector<Keyframe>& keyframes) {
  std::vector<double> result;
  for (const auto& k : keyframes) result.push_back(k.t);
  return result;
}

void expect_times(const TrackingData& data, const std::vector<double>& expected, std::size_t max_count = 0) {
  EXPECT_THAT(times(make_keyframes(data, max_count)), ::testing::Pointwise(::testing::DoubleNear(1e-12), expected));
}

TEST(Keyframes, AreAtEndsMeasurementsAndIntervals) {
  expect_times(measured_at({1.3}), {0, 1, 1.3, 2.3, 3.3, 4.3, 5});
  expect_times(measured_at({0.0, 5.0}), {0, 1, 2, 3, 4, 5});
  expect_times(measured_at({0.2, 0.4, 3.0}), {0, 0.2, 0.4, 1.4, 2.4, 3, 4, 5});
}

TEST(Keyframes, IntervalStartsAtLastKeyframe) {
  TrackingData data = measured_at({0.7});
  data.keyframe_interval = 2.0;
  expect_times(data, {0, 0.7, 2.7, 4.7, 5});
}

TEST(Keyframes, MergesTimesWithinOneMillisecond) {
  expect_times(measured_at({1.0, 1.0009, 2.0004, 4.9995}), {0, 1, 2.0004, 3.0004, 4.0004, 4.9995});
  expect_times(measured_at({0.0008, 0.5, 0.5011}), {0, 0.5, 0.5011, 1.5011, 2.5011, 3.5011, 4.5011, 5});
}

TEST(Keyframes, UsesAllMeasurementsOfMergedKeyframe) {
  TrackingData data = measured_at({2.0, 2.0009});
  TrackingProblem tracking = make_tracking_problem(data);
  const std::size_t n = tracking.keyframes.size();
  EXPECT_EQ(n, 6u);
  EXPECT_EQ(tracking.problem.num_soft_blocks(), int(1 + (n - 1) + 2 + (n - 2) + n));
}

TEST(Keyframes, AssignsMeasurementToNearestKeyframe) {
  const auto keyframes = make_keyframes(measured_at({1.0, 1.001, 1.0025}));
  for (std::size_t k = 0; k < keyframes.size(); ++k) EXPECT_EQ(keyframe_at(keyframes, keyframes[k].t), k);
  EXPECT_EQ(keyframe_at(keyframes, 3.5), std::nullopt);
}

TEST(Keyframes, AssignsMeasurementJustOutsideSpanToItsEnd) {
  const auto keyframes = make_keyframes(measured_at({-0.0005, 5.0005}));
  EXPECT_THAT(times(keyframes), ::testing::ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_EQ(keyframes.front().type, KeyframeType::position);
  EXPECT_EQ(keyframes.back().type, KeyframeType::position);
}

TEST(Keyframes, LimitsTheirNumber) {
  expect_times(measured_at({1.3, 4.0}), {0, 1, 1.3}, 3);
  expect_times(measured_at({1.3}), {0, 1, 1.3, 2.3, 3.3, 4.3, 5}, 100);
  EXPECT_THROW(make_keyframes(measured_at({1.3}), 2), Error);  // no measurement remains
}

TEST(Keyframes, PoseTakesPrecedenceOverPosition) {
  TrackingData data = measured_at({1.0, 2.0});
  data.sensors[0].mount = SE3(SO3(), Vector<3>(0.0, 0.5, 0.0));
  TargetSensor camera{.name = "optical", .type = SensorType::pose};
  camera.sigma = Vector<6>::Constant(0.1);
  camera.mount = Simulation::pose(0.3, 0.0, 0.0, 0.5);
  camera.marker = Simulation::pose(-0.2, 0.1, 0.0, 0.3);
  const SE3 body = Simulation::pose(4.0, 1.0, 0.0, -0.4);
  const SE3 seen = camera.mount.inverse() * body * camera.marker;
  camera.measurements = {{.t = 2.0, .position = seen.translation(), .rotation = seen.rotation()}};
  data.sensors.push_back(camera);
  const auto keyframes = make_keyframes(data);
  EXPECT_EQ(keyframes[0].type, KeyframeType::none);
  EXPECT_FALSE(keyframes[0].measured_position.has_value());
  EXPECT_EQ(keyframes[1].type, KeyframeType::position);
  EXPECT_TRUE(keyframes[1].measured_position->isApprox(Vector<3>(1.0, 0.5, 0.0)));
  EXPECT_FALSE(keyframes[1].measured_rotation.has_value());
  EXPECT_EQ(keyframes[2].type, KeyframeType::pose);
  EXPECT_TRUE(keyframes[2].measured_position->isApprox(body.translation()));
  EXPECT_TRUE(keyframes[2].measured_rotation->matrix().isApprox(body.rotation().matrix()));
}

TEST(Keyframes, PositionTakesPrecedenceOverPartialMeasurement) {
  for (const bool bearing_first : {false, true}) {
    TrackingData data = measured_at({1.0, 2.0});
    TargetSensor modem{.name = "modem", .type = SensorType::range, .sigma = Vector<1>(0.1)};
    modem.measurements = {{.t = 2.0, .range = 3}, {.t = 3.0, .range = 3}};
    data.sensors.insert(bearing_first ? data.sensors.begin() : data.sensors.end(), modem);
    const auto keyframes = make_keyframes(data);
    EXPECT_EQ(keyframes[2].type, KeyframeType::position);
    EXPECT_TRUE(keyframes[2].measured_position.has_value());
    EXPECT_EQ(keyframes[3].t, 3.0);
    EXPECT_EQ(keyframes[3].type, KeyframeType::partial);
    EXPECT_FALSE(keyframes[3].measured_position.has_value());
    EXPECT_EQ(keyframes[4].type, KeyframeType::none);
  }
}

TEST(Keyframes, TypesHaveNames) {
  EXPECT_EQ(name(KeyframeType::position), "position");
  EXPECT_EQ(name(KeyframeType::pose), "pose");
  EXPECT_EQ(name(KeyframeType::partial), "partial");
  EXPECT_EQ(name(KeyframeType::none), "none");
}

TEST(Tracking, InterpolatesOdometryOnGroup) {
  const TrackingData data = Simulation().data();
  const auto keyframes = make_keyframes(data);
  const auto poses = odometry_at(data.odometry, keyframes);
  ASSERT_EQ(poses.size(), keyframes.size());
  for (std::size_t k = 0; k < poses.size(); ++k)  // exact, because the chaser's twist is constant
    EXPECT_LE((Simulation::chaser(keyframes[k].t).inverse() * poses[k]).Log().norm(), 1e-13);
}

TEST(Tracking, RejectsUnusableData) {
  TrackingData none = measured_at({1.0});
  none.odometry.clear();
  EXPECT_THAT([&] { make_tracking_problem(none); }, ThrowsMessage<Error>(HasSubstr("odometry")));
  none.odometry = {{0.0, SE3()}};
  EXPECT_THAT([&] { make_tracking_problem(none); }, ThrowsMessage<Error>(HasSubstr("at least two poses")));
  EXPECT_THAT([&] { make_tracking_problem(measured_at({})); }, ThrowsMessage<Error>(HasSubstr("measurements")));
  for (const double t : {-0.5, 5.2})
    EXPECT_THAT(
        [&] {
          make_tracking_problem(measured_at({1.0, t}));
        },
        ThrowsMessage<Error>(HasSubstr("usbl: the measurement at")));
  TrackingData interval = measured_at({1.0});
  interval.keyframe_interval = 0.0;
  EXPECT_THAT([&] { make_tracking_problem(interval); }, ThrowsMessage<Error>(HasSubstr("keyframe_interval")));
}

class TrackingOptionsTest : public ::testing::Test {
 protected:
  TrackingData data = Simulation().data();
  int n = static_cast<int>(make_keyframes(data).size());
  int measurements = static_cast<int>(data.sensors[0].measurements.size() + data.sensors[1].measurements.size());
  int plain = 1 + (n - 1) + measurements + (n - 2);  // prior, odometry, measurements, constant twist

  void expect(const TrackingOptions& options, int soft, int equalities, int inequalities) {
    const TrackingProblem tracking = make_tracking_problem(data, options);
    EXPECT_EQ(tracking.problem.num_soft_blocks(), soft);
    EXPECT_EQ(tracking.problem.size().equalities, equalities);
    EXPECT_EQ(tracking.problem.size().inequalities, inequalities);
    EXPECT_EQ(tracking.problem.size().unknowns, 12 * n);
  }
};

TEST_F(TrackingOptionsTest, RollPitch) {
  expect({}, plain + n, 0, 0);
  expect({.roll_pitch = Role::off}, plain, 0, 0);
  expect({.roll_pitch = Role::hard}, plain, 2 * n, 0);
}

TEST_F(TrackingOptionsTest, NonHolonomic) {
  expect({.non_holonomic = Role::soft}, plain + n + n - 1, 0, 0);
  expect({.non_holonomic = Role::hard}, plain + n, 2 * (n - 1), 0);
}

TEST_F(TrackingOptionsTest, Limits) {
  expect({.surge = between(0.0, 2.0)}, plain + n, 0, n - 1);
  expect({.surge = between(0.0, 2.0), .limits = Role::soft}, plain + n + n - 1, 0, 0);
  expect({.surge = between(0.0, 2.0), .limits = Role::off}, plain + n, 0, 0);
  expect({.max_yaw_rate = 0.1}, plain + n, 0, n - 1);
  expect({.surge = at_least(0.0), .max_yaw_rate = 0.1}, plain + n, 0, 2 * (n - 1));
  expect({.surge = at_least(0.0), .max_yaw_rate = 0.1, .limits = Role::soft}, plain + n + 2 * (n - 1), 0, 0);
}

TEST_F(TrackingOptionsTest, AllHardConstraints) {
  expect({.roll_pitch = Role::hard, .non_holonomic = Role::hard, .surge = at_least(0.0), .max_yaw_rate = 0.1}, plain,
         2 * n + 2 * (n - 1), 2 * (n - 1));
}

TEST_F(TrackingOptionsTest, LossAppliesToMeasurementsOnly) {
  const auto cost = [&](const Loss& loss) {
    TrackingProblem tracking = make_tracking_problem(data, {.loss = loss});
    const auto k = keyframe_at(tracking.keyframes, data.sensors[0].measurements[2].t);
    tracking.problem.set_value(pose(tracking.target[*k]), Simulation::target(0.0));
    return NlpEvaluator(tracking.problem).cost();
  };
  const double quadratic = cost({}), robust = cost(Tukey(1.0));
  EXPECT_LT(robust, quadratic);
  EXPECT_GT(robust, 1.0) << "odometry, motion and priors have no loss";
}

TEST(Tracking, OrdersVariablesByKeyframe) {
  const TrackingProblem tracking = make_tracking_problem(measured_at({1.0, 2.0}));
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(tracking.problem.name(2 * k), "chaser " + std::to_string(k));
    EXPECT_EQ(tracking.problem.name(2 * k + 1), "target " + std::to_string(k));
    EXPECT_EQ(tracking.problem.id(pose(tracking.target[std::size_t(k)])), 2 * k + 1);
  }
}

Simulation with_extrinsics() {
  Simulation simulation;
  simulation.usbl_mount = SE3::Exp((Vector<6>() << 0.5, -0.2, 0.3, 0.4, 0.1, -0.9).finished());
  simulation.optical_mount = SE3::Exp((Vector<6>() << 1.2, 0.1, -0.4, -0.3, 0.5, 0.2).finished());
  simulation.marker = SE3::Exp((Vector<6>() << -0.8, 0.3, 0.2, 0.1, -0.2, 2.5).finished());
  simulation.beacon = {0.4, -0.1, 0.6};
  return simulation;
}

TEST(Tracking, CostIsZeroAtTruth) {
  for (const Simulation& simulation : {Simulation(), with_extrinsics()}) {
    TrackingProblem tracking = make_tracking_problem(simulation.data(), {.roll_pitch = Role::soft,
                                                                         .non_holonomic = Role::soft,
                                                                         .surge = between(0.0, 1.0),
                                                                         .max_yaw_rate = 0.1,
                                                                         .limits = Role::soft});
    EXPECT_GT(NlpEvaluator(tracking.problem).cost(), 1.0);
    for (std::size_t k = 0; k < tracking.keyframes.size(); ++k)
      tracking.problem.set_value(pose(tracking.target[k]), Simulation::target(tracking.keyframes[k].t));
    EXPECT_LE(NlpEvaluator(tracking.problem).cost(), 1e-20);
  }
}

TEST(Tracking, InitialGuessIsNearTruth) {
  for (const Simulation& simulation : {Simulation(), with_extrinsics()}) {
    const TrackingProblem tracking = make_tracking_problem(simulation.data());
    for (std::size_t k = 0; k < tracking.keyframes.size(); ++k) {
      const double t = tracking.keyframes[k].t;
      const SE3 chaser = tracking.chaser_pose(k);
      EXPECT_LE((Simulation::chaser(t).inverse() * chaser).Log().norm(), 1e-13);
      const SE3 target = tracking.problem.value(pose(tracking.target[k]));
      EXPECT_LE((target.translation() - Simulation::target(t).translation()).norm(), 1.0) << t;
      const double angle = (Simulation::target(t).rotation().inverse() * target.rotation()).Log().norm();
      EXPECT_LE(angle, tracking.keyframes[k].type == KeyframeType::pose ? 1e-12 : 0.6) << t;
    }
  }
}

TEST(Tracking, BuildingThrowsStopped) {
  const TrackingData data = Simulation().data();
  std::atomic<bool> stop = true;
  EXPECT_THROW(make_tracking_problem(data, {}, Stop(&stop)), Stopped);
  EXPECT_THROW(make_tracking_problem(data, {.robust_initial_guess = true}, Stop(nullptr, 0)), Stopped);
  stop = false;
  EXPECT_EQ(make_tracking_problem(data, {}, Stop(&stop)).problem.num_soft_blocks(),
            make_tracking_problem(data).problem.num_soft_blocks());
}

TEST(Tracking, InitialHeadingIsDirectionOfTravelWithoutPoses) {
  Simulation simulation;
  simulation.optical = false;
  const TrackingProblem tracking = make_tracking_problem(simulation.data());
  for (std::size_t k = 0; k < tracking.keyframes.size(); ++k) {
    const SO3 R = tracking.problem.value(pose(tracking.target[k])).rotation();
    EXPECT_LE((Simulation::target(tracking.keyframes[k].t).rotation().inverse() * R).Log().norm(), 0.6);
    EXPECT_EQ(R.matrix()(2, 2), 1.0);  // level
  }
}

}  // namespace
}  // namespace tandem::testing
